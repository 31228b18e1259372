//! All orders of up to seven steps of a camera's thread and of a caller of [`LatestFrame`], compared with a model
//! without threads. Steps do not overlap, because every operation on [`LatestFrame`] holds one lock.

use std::collections::VecDeque;
use std::sync::mpsc::channel;
use std::time::Duration;

use super::LatestFrame;
use super::tests::Driven;

/// Maximum number of steps: there are 3 + 9 + … + 3⁷ = 3279 schedules.
const MAX_TURNS: u32 = 7;

#[derive(Debug, Clone, Copy, PartialEq)]
enum Turn {
    /// The camera delivers a frame.
    Frame,
    /// The camera reports a fault.
    Torn,
    /// The caller takes the current frame or error.
    Take,
}

const TURNS: [Turn; 3] = [Turn::Frame, Turn::Torn, Turn::Take];

/// The specification of [`LatestFrame`], without threads.
#[derive(Default)]
struct Model {
    newest: Option<u64>,
    errors: VecDeque<()>,
    num_dropped: u64,
}

impl Model {
    fn take(&mut self) -> Result<Option<u64>, ()> {
        if self.errors.pop_front().is_some() {
            return Err(());
        }
        Ok(self.newest.take())
    }
}

fn check(schedule: &[Turn]) {
    let (send, receive) = channel();
    let (asked, was_asked) = channel();
    let latest = LatestFrame::spawn(Box::new(Driven(receive, asked)));
    // Declared after `latest`, so that it is dropped first if an assertion fails; otherwise `latest` would wait for its
    // thread for ever.
    let send = send;
    was_asked.recv().unwrap();
    let mut model = Model::default();
    let take = |model: &mut Model, timeout| {
        let found = latest.take(timeout).map(|frame| frame.map(|frame| frame.number)).map_err(drop);
        assert_eq!(found, model.take(), "{schedule:?}");
        assert_eq!(latest.num_dropped(), model.num_dropped, "{schedule:?}");
    };
    for (number, turn) in (0..).zip(schedule) {
        match turn {
            Turn::Frame => {
                send.send(Some(number)).unwrap();
                model.num_dropped += u64::from(model.newest.replace(number).is_some());
            }
            Turn::Torn => {
                send.send(None).unwrap();
                model.errors.push_back(());
            }
            Turn::Take => {
                take(&mut model, Duration::ZERO);
                continue;
            }
        }
        // The camera is asked again after its last frame or error was stored.
        was_asked.recv().unwrap();
    }
    assert!(!latest.has_ended(), "{schedule:?}");
    drop(send);
    // Everything that was not taken is delivered before the end.
    while model.newest.is_some() || !model.errors.is_empty() {
        take(&mut model, Duration::ZERO);
    }
    take(&mut model, Duration::from_secs(10));
    assert!(latest.has_ended(), "{schedule:?}");
}

#[test]
fn every_schedule_gives_what_the_cell_promises() {
    let mut num_schedules = 0;
    for length in 1..=MAX_TURNS {
        for number in 0..3_usize.pow(length) {
            let digits = (0..length).map(|place| TURNS[number / 3_usize.pow(place) % 3]);
            check(&digits.collect::<Vec<_>>());
            num_schedules += 1;
        }
    }
    assert_eq!(num_schedules, 3279);
}

/// A waiting caller is woken by a frame and by an error; the camera's end is reported.
#[test]
fn a_caller_that_waits_is_woken() {
    for (sent, expected) in [(Some(Some(7)), Ok(Some(7))), (Some(None), Err(())), (None, Ok(None))] {
        let (send, receive) = channel();
        let (asked, was_asked) = channel();
        let latest = LatestFrame::spawn(Box::new(Driven(receive, asked)));
        was_asked.recv().unwrap();
        let feeder = std::thread::spawn(move || {
            // By now the caller waits. If it does not, the order is one of those tested above.
            std::thread::sleep(Duration::from_millis(20));
            if let Some(sent) = sent {
                send.send(sent).unwrap();
            }
            send
        });
        if sent.is_none() {
            drop(feeder.join().unwrap());
            assert_eq!(
                latest.take(Duration::from_secs(60)).map(|frame| frame.map(|frame| frame.number)).map_err(drop),
                expected
            );
            continue;
        }
        let found = latest.take(Duration::from_secs(60)).map(|frame| frame.map(|frame| frame.number)).map_err(drop);
        assert_eq!(found, expected);
        drop(feeder.join().unwrap());
    }
}
