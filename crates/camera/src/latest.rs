//! A thread that reads a camera continuously, so that the newest frame is available at once.

use std::collections::VecDeque;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use crate::error::CameraError;
use crate::fault::Fault;
use crate::frame::{Camera, Frame};

/// Maximum number of unread errors; the oldest ones are dropped. It is below the 15 faults in a row that `sdg` skips, so
/// that the faults of a time in which nobody reads do not end a command.
const MAX_ERRORS: usize = 8;

/// The newest frame of a camera that a thread reads; older frames are dropped and counted.
///
/// It is a [`Camera`] itself: [`next_frame`](Camera::next_frame) returns each frame at most once. Dropping it waits
/// until the thread has finished the current frame and the camera is closed.
pub struct LatestFrame {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

#[derive(Default)]
struct Shared {
    newest: Mutex<Newest>,
    changed: Condvar,
    is_stopped: AtomicBool,
}

#[derive(Default)]
struct Newest {
    frame: Option<Frame>,
    errors: VecDeque<CameraError>,
    has_ended: bool,
    num_dropped: u64,
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, Newest> {
        // No operation under this lock can leave the data in an invalid state.
        self.newest.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl LatestFrame {
    /// Reads the camera in a thread until this object is dropped, the camera ends, or a permanent error occurs.
    pub fn spawn(mut camera: Box<dyn Camera>) -> Self {
        let shared = Arc::new(Shared::default());
        let writer = Arc::clone(&shared);
        let thread = std::thread::spawn(move || {
            while !writer.is_stopped.load(Ordering::SeqCst) {
                let next = camera.next_frame();
                let mut newest = writer.lock();
                match next {
                    Ok(Some(mut frame)) => {
                        if let Some(dropped) = newest.frame.take() {
                            newest.num_dropped += 1;
                            // A camera reports these faults once, so they are kept for a caller that missed the frame.
                            let once = |fault: &Fault| matches!(fault, Fault::Back { .. } | Fault::OtherSize { .. });
                            frame.faults.extend(dropped.faults.into_iter().filter(once));
                        }
                        newest.frame = Some(frame);
                    }
                    Ok(None) => newest.has_ended = true,
                    Err(error) => {
                        newest.has_ended = !error.is_passing();
                        if newest.errors.len() == MAX_ERRORS {
                            newest.errors.pop_front();
                        }
                        newest.errors.push_back(error);
                    }
                }
                let has_ended = newest.has_ended;
                drop(newest);
                writer.changed.notify_all();
                if has_ended {
                    return;
                }
            }
        });
        Self { shared, thread: Some(thread) }
    }

    /// The newest frame that was not taken yet; waits for one if there is none. Returns `None` after the timeout and at
    /// the camera's end ([`has_ended`](Self::has_ended)).
    ///
    /// # Errors
    /// Each error of the camera, once, before the frame. Of more than 8 unread errors, the oldest are lost.
    pub fn take(&self, timeout: Duration) -> Result<Option<Frame>, CameraError> {
        let deadline = Instant::now() + timeout;
        let mut newest = self.shared.lock();
        loop {
            if let Some(error) = newest.errors.pop_front() {
                return Err(error);
            }
            if let Some(frame) = newest.frame.take() {
                return Ok(Some(frame));
            }
            let left = deadline.saturating_duration_since(Instant::now());
            if newest.has_ended || left.is_zero() {
                return Ok(None);
            }
            let waited = self.shared.changed.wait_timeout(newest, left);
            newest = waited.unwrap_or_else(PoisonError::into_inner).0;
        }
    }

    /// Whether the camera has ended, and all frames and errors were taken.
    pub fn has_ended(&self) -> bool {
        let newest = self.shared.lock();
        newest.has_ended && newest.frame.is_none() && newest.errors.is_empty()
    }

    /// Number of frames that were replaced by newer ones before they were taken. Gaps in [`Frame::number`] also count
    /// frames that the camera did not deliver.
    pub fn num_dropped(&self) -> u64 {
        self.shared.lock().num_dropped
    }
}

impl Camera for LatestFrame {
    fn next_frame(&mut self) -> Result<Option<Frame>, CameraError> {
        loop {
            // The camera's own stall timeout ends the wait with an error, so this timeout has no effect.
            match self.take(Duration::from_secs(1))? {
                Some(frame) => return Ok(Some(frame)),
                // The thread may have panicked and finished without reporting the end.
                None if self.has_ended() || self.thread.as_ref().is_none_or(JoinHandle::is_finished) => {
                    return Ok(None);
                }
                None => {}
            }
        }
    }
}

impl Drop for LatestFrame {
    fn drop(&mut self) {
        self.shared.is_stopped.store(true, Ordering::SeqCst);
        if let Some(thread) = self.thread.take() {
            // The panic message was printed by the camera's thread.
            let _ = thread.join();
        }
    }
}

#[cfg(test)]
mod schedules;

#[cfg(test)]
mod tests {
    use super::*;
    use image::RgbImage;
    use std::sync::mpsc::{Receiver, Sender, channel};

    /// Delivers a frame for each number that is received, and a fault for `None`; sends a message before each.
    pub(super) struct Driven(pub(super) Receiver<Option<u64>>, pub(super) Sender<()>);

    impl Camera for Driven {
        fn next_frame(&mut self) -> Result<Option<Frame>, CameraError> {
            let _ = self.1.send(());
            match self.0.recv() {
                Ok(Some(number)) => Ok(Some(Frame::new(RgbImage::new(1, 1), number, "test:".into()))),
                Ok(None) => Err(crate::source::fault("test:", Fault::Black)),
                Err(_) => Ok(None),
            }
        }
    }

    #[test]
    fn of_many_unread_errors_a_limited_number_is_kept() {
        let (send, receive) = channel();
        let (asked, was_asked) = channel();
        let latest = LatestFrame::spawn(Box::new(Driven(receive, asked)));
        // Declared last, for the reason given in the next test.
        let send = send;
        for _ in 0..MAX_ERRORS + 5 {
            was_asked.recv().unwrap();
            send.send(None).unwrap();
        }
        was_asked.recv().unwrap();
        assert_eq!(std::iter::from_fn(|| latest.take(Duration::ZERO).err()).count(), MAX_ERRORS);
    }

    #[test]
    fn the_newest_frame_is_given_and_the_others_are_counted() {
        let (send, receive) = channel();
        let (asked, was_asked) = channel();
        let mut latest = LatestFrame::spawn(Box::new(Driven(receive, asked)));
        // Declared last, so that it is dropped first if an assertion fails; otherwise `latest` would wait for its
        // thread for ever.
        let send = send;
        assert!(latest.take(Duration::from_millis(20)).unwrap().is_none() && !latest.has_ended());
        for number in 0..5 {
            was_asked.recv().unwrap();
            send.send(Some(number)).unwrap();
        }
        // The request for the sixth frame shows that the fifth is stored.
        was_asked.recv().unwrap();
        assert_eq!(latest.take(Duration::ZERO).unwrap().unwrap().number, 4);
        assert_eq!(latest.num_dropped(), 4);
        assert!(latest.take(Duration::ZERO).unwrap().is_none(), "each frame once");
        send.send(None).unwrap();
        assert!(latest.next_frame().unwrap_err().is_passing());
        send.send(Some(9)).unwrap();
        assert_eq!(latest.next_frame().unwrap().unwrap().number, 9);
        drop(send);
        assert!(latest.next_frame().unwrap().is_none() && latest.has_ended());
    }

    #[test]
    fn dropping_it_closes_the_camera() {
        let (send, receive) = channel();
        let (asked, _was_asked) = channel();
        let latest = LatestFrame::spawn(Box::new(Driven(receive, asked)));
        send.send(Some(1)).unwrap();
        let sender = send.clone();
        let feeder = std::thread::spawn(move || while sender.send(Some(2)).is_ok() {});
        drop(latest);
        assert!(send.send(Some(3)).is_err(), "the receiver is gone");
        feeder.join().unwrap();
    }
}
