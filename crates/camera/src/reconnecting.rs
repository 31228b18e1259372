//! A camera that is reopened when its connection is lost, with growing pauses.

use std::sync::Arc;
use std::thread::sleep;
use std::time::{Duration, Instant};

use crate::error::CameraError;
use crate::fault::Fault;
use crate::frame::{Camera, Frame};
use crate::source::{Missing, Source, fault};

/// Pause before the first attempt to reopen. Each further pause is twice as long.
const FIRST_PAUSE: Duration = Duration::from_millis(100);
/// Maximum pause: a camera that was plugged in again is reopened within this time.
const MAX_PAUSE: Duration = Duration::from_secs(5);
/// Number of stall timeouts in a row after which the connection is dropped: the other end may have disappeared without
/// closing the connection.
const MAX_STALLS: u32 = 3;
/// Number of torn frames in a row after which the connection is dropped: the frame boundaries may be lost. Files are
/// then read after a pause.
const MAX_TORN: u32 = 30;

/// Opens a connection; the deadline applies only to HTTP.
pub(crate) type Opener = Box<dyn FnMut(Instant) -> Result<Box<dyn Source>, CameraError> + Send>;

/// A camera that is reopened; frames are numbered across its connections.
pub(crate) struct Reconnecting {
    name: Arc<str>,
    opener: Opener,
    source: Option<Box<dyn Source>>,
    stall_timeout: Duration,
    next_number: u64,
    /// Whether any connection has delivered a picture.
    has_delivered: bool,
    last_frame: Instant,
    num_stalls: u32,
    num_torn: u32,
    lost: Option<Lost>,
    pause: Duration,
}

/// A lost connection.
struct Lost {
    since: Instant,
    why: String,
    retry_at: Instant,
}

impl Reconnecting {
    /// Opens the first connection.
    ///
    /// # Errors
    /// The errors of the opener: a wrong address fails immediately.
    pub(crate) fn open(name: Arc<str>, mut opener: Opener, stall_timeout: Duration) -> Result<Self, CameraError> {
        let source = opener(Instant::now() + stall_timeout)?;
        Ok(Self {
            name,
            opener,
            source: Some(source),
            stall_timeout,
            next_number: 0,
            has_delivered: false,
            last_frame: Instant::now(),
            num_stalls: 0,
            num_torn: 0,
            lost: None,
            pause: FIRST_PAUSE,
        })
    }

    /// Drops the connection and schedules the next attempt.
    fn lose(&mut self, why: String) -> CameraError {
        // A device or a process must be closed before it is reopened. A folder is kept, because it knows which files
        // were read.
        self.source.take_if(|source| source.has_connection());
        (self.num_stalls, self.num_torn) = (0, 0);
        let now = Instant::now();
        let since = self.lost.take().map_or(now, |lost| lost.since);
        self.lost = Some(Lost { since, why: why.clone(), retry_at: now + self.pause });
        self.pause = (self.pause * 2).min(MAX_PAUSE);
        fault(&self.name, Fault::Gone { why })
    }

    /// Waits for the end of the pause after a loss; fails if the pause ends after the deadline.
    fn wait_for_retry(&self, deadline: Instant) -> Result<(), CameraError> {
        let Some(Lost { why, retry_at, .. }) = &self.lost else { return Ok(()) };
        sleep((*retry_at).min(deadline).saturating_duration_since(Instant::now()));
        if *retry_at > deadline {
            return Err(fault(&self.name, Fault::Gone { why: why.clone() }));
        }
        Ok(())
    }

    fn reopen(&mut self, deadline: Instant) -> Result<(), CameraError> {
        match (self.opener)(deadline) {
            Ok(source) => {
                self.source = Some(source);
                Ok(())
            }
            Err(error) => Err(self.lose(without_address(&error, &self.name))),
        }
    }
}

/// Removes the address, which the fault's text already contains.
fn without_address(error: &CameraError, name: &str) -> String {
    let text = error.to_string();
    text.strip_prefix(name).and_then(|rest| rest.strip_prefix(": ")).map_or(text.clone(), str::to_owned)
}

impl Camera for Reconnecting {
    fn next_frame(&mut self) -> Result<Option<Frame>, CameraError> {
        let deadline = Instant::now() + self.stall_timeout;
        self.wait_for_retry(deadline)?;
        let source = loop {
            match &mut self.source {
                Some(source) => break source,
                None => self.reopen(deadline)?,
            }
        };
        let has_connection = source.has_connection();
        match source.take(deadline) {
            Ok(Some(taken)) => {
                self.next_number += taken.num_skipped + 1;
                (self.last_frame, self.num_stalls, self.num_torn) = (Instant::now(), 0, 0);
                (self.pause, self.has_delivered) = (FIRST_PAUSE, true);
                let back = self.lost.take().map(|lost| Fault::Back { away_secs: lost.since.elapsed().as_secs_f64() });
                Ok(Some(Frame {
                    picture: taken.picture,
                    number: self.next_number - 1,
                    captured: taken.captured,
                    camera: Arc::clone(&self.name),
                    faults: back.into_iter().collect(),
                }))
            }
            Ok(None) => Ok(None),
            Err(Missing::Late) => {
                self.num_stalls += 1;
                let silent_secs = self.last_frame.elapsed().as_secs_f64();
                if has_connection && self.num_stalls >= MAX_STALLS {
                    return Err(self.lose(format!("no frame for {silent_secs:.1} s, so the camera is reopened")));
                }
                Err(fault(&self.name, Fault::Stale { silent_secs }))
            }
            Err(Missing::Torn(found)) => {
                self.num_torn += 1;
                self.next_number += 1;
                if self.num_torn >= MAX_TORN {
                    if has_connection {
                        return Err(self.lose(format!("{MAX_TORN} torn pictures in a row, the last: {found}")));
                    }
                    // Without a pause, a looped folder whose files are all broken would occupy a core.
                    self.num_torn = 0;
                    sleep(FIRST_PAUSE.min(self.stall_timeout));
                }
                Err(fault(&self.name, Fault::Torn { found }))
            }
            Err(Missing::Gone(why)) => Err(self.lose(why)),
            // The same command has delivered pictures before, so its camera may come back.
            Err(Missing::Ended(why)) if self.has_delivered => Err(self.lose(why)),
            Err(Missing::Ended(why)) => Err(CameraError::Ended { camera: self.name.to_string(), why }),
        }
    }

    fn is_on_request(&self) -> bool {
        self.source.as_ref().is_some_and(|source| source.is_on_request())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::source::Taken;
    use image::RgbImage;
    use std::collections::VecDeque;
    use std::sync::atomic::{AtomicU32, Ordering};

    type Step = Result<Option<Taken>, Missing>;

    struct Script(VecDeque<Step>);

    impl Source for Script {
        fn take(&mut self, deadline: Instant) -> Step {
            self.0.pop_front().unwrap_or_else(|| {
                sleep(deadline.saturating_duration_since(Instant::now()));
                Err(Missing::Late)
            })
        }
    }

    fn picture() -> Step {
        Ok(Some(Taken::now(RgbImage::new(1, 1))))
    }

    /// A camera whose connections give these results; `Err` is a connection that cannot be opened.
    fn camera(connections: Vec<Result<Vec<Step>, &'static str>>) -> (Reconnecting, Arc<AtomicU32>) {
        let mut connections = connections.into_iter();
        let opened = Arc::new(AtomicU32::new(0));
        let counter = Arc::clone(&opened);
        let opener: Opener = Box::new(move |_| {
            counter.fetch_add(1, Ordering::SeqCst);
            let failed = |why: &str| CameraError::Open { address: "test:".into(), why: why.into() };
            match connections.next() {
                Some(Ok(steps)) => Ok(Box::new(Script(steps.into())) as Box<dyn Source>),
                Some(Err(why)) => Err(failed(why)),
                None => Err(failed("nothing more")),
            }
        });
        (Reconnecting::open("test:".into(), opener, Duration::from_millis(50)).unwrap(), opened)
    }

    fn fault_of(camera: &mut Reconnecting) -> Fault {
        let error = camera.next_frame().unwrap_err();
        assert!(error.is_passing(), "{error}");
        error.fault().unwrap().clone()
    }

    #[test]
    fn a_lost_connection_is_opened_again_and_frames_are_counted_on() {
        let (mut camera, opened) = camera(vec![
            Ok(vec![picture(), Err(Missing::Torn("half".into())), picture(), Err(Missing::Gone("cable".into()))]),
            Err("refused"),
            Ok(vec![picture()]),
        ]);
        assert_eq!(camera.next_frame().unwrap().unwrap().number, 0);
        assert_eq!(fault_of(&mut camera), Fault::Torn { found: "half".into() });
        assert_eq!(camera.next_frame().unwrap().unwrap().number, 2);
        assert_eq!(fault_of(&mut camera), Fault::Gone { why: "cable".into() });
        // The pause of 100 ms is longer than the stall timeout of 50 ms, so this call ends before the connection is
        // reopened.
        assert!(matches!(fault_of(&mut camera), Fault::Gone { .. }));
        let back = loop {
            match camera.next_frame() {
                Ok(frame) => break frame.unwrap(),
                Err(error) => assert!(matches!(error.fault(), Some(Fault::Gone { .. })), "{error}"),
            }
        };
        assert_eq!((back.number, opened.load(Ordering::SeqCst)), (3, 3));
        assert!(matches!(back.faults[..], [Fault::Back { away_secs }] if away_secs > 0.25), "{:?}", back.faults);
    }

    #[test]
    fn silence_is_stale_and_then_opened_again() {
        let (mut camera, opened) = camera(vec![Ok(vec![]), Ok(vec![picture()])]);
        for _ in 1..MAX_STALLS {
            assert!(matches!(fault_of(&mut camera), Fault::Stale { silent_secs } if silent_secs >= 0.05));
        }
        assert!(matches!(fault_of(&mut camera), Fault::Gone { why } if why.contains("no frame for 0.")));
        while camera.next_frame().is_err() {}
        assert_eq!(opened.load(Ordering::SeqCst), 2);
    }

    #[test]
    fn a_stream_of_torn_pictures_is_opened_again() {
        let torn = || Err(Missing::Torn("noise".into()));
        let (mut camera, _) = camera(vec![Ok((0..MAX_TORN).map(|_| torn()).collect())]);
        for _ in 1..MAX_TORN {
            assert!(matches!(fault_of(&mut camera), Fault::Torn { .. }));
        }
        assert!(matches!(fault_of(&mut camera), Fault::Gone { why } if why.contains("30 torn")));
    }
}
