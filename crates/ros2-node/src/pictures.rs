//! Pictures from a topic: received and decoded on a thread, queued until they are searched.

use std::collections::VecDeque;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, OnceLock, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant, SystemTime};

use image::RgbImage;
use sdg_ros2::dds::{Node, Qos, Received, Subscription, network_thread, stamp_or_now};
use sdg_ros2::messages::{CompressedImage, Header, Image, Message};
use sdg_ros2::{PictureError, RosError, encoding};

use crate::lines::Lines;

/// Interval at which a thread checks whether it must end.
const POLL_INTERVAL: Duration = Duration::from_millis(100);

/// A picture with its header and times.
#[derive(Debug, Clone)]
pub(super) struct Picture {
    pub(super) header: Header,
    pub(super) picture: Arc<RgbImage>,
    pub(super) arrived: Instant,
    /// Time of the stamp, or of the arrival if the stamp is later or from another clock.
    pub(super) captured: SystemTime,
}

/// Counters for the diagnostics.
#[derive(Debug, Default)]
pub(super) struct Counts {
    pub(super) received: AtomicU64,
    pub(super) refused: AtomicU64,
    pub(super) skipped: AtomicU64,
    pub(super) lost: AtomicU64,
}

#[derive(Default)]
struct Kept {
    waiting: VecDeque<Picture>,
    newest: Option<Picture>,
}

/// The queued pictures, and the newest one.
pub(super) struct Shared {
    kept: Mutex<Kept>,
    changed: Condvar,
    is_stopped: AtomicBool,
    queue: usize,
    pub(super) counts: Counts,
    /// The error after which no more pictures arrive.
    pub(super) ended: OnceLock<RosError>,
}

impl Shared {
    pub(super) fn new(queue: usize) -> Self {
        Self {
            kept: Mutex::default(),
            changed: Condvar::new(),
            is_stopped: AtomicBool::new(false),
            queue,
            counts: Counts::default(),
            ended: OnceLock::new(),
        }
    }

    fn lock(&self) -> MutexGuard<'_, Kept> {
        self.kept.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The next queued picture.
    pub(super) fn next(&self, timeout: Duration) -> Option<Picture> {
        let kept = self.lock();
        let waited = self.changed.wait_timeout_while(kept, timeout, |kept| kept.waiting.is_empty());
        waited.unwrap_or_else(PoisonError::into_inner).0.waiting.pop_front()
    }

    /// The newest picture, if it was taken after a time; waits for one until the timeout.
    pub(super) fn newer_than(&self, time: SystemTime, timeout: Duration) -> Option<Picture> {
        let is_old = |kept: &mut Kept| kept.newest.as_ref().is_none_or(|newest| newest.captured < time);
        let waited = self.changed.wait_timeout_while(self.lock(), timeout, is_old);
        let mut kept = waited.unwrap_or_else(PoisonError::into_inner).0;
        if is_old(&mut kept) { None } else { kept.newest.clone() }
    }

    /// The time at which the newest picture arrived.
    pub(super) fn newest_arrival(&self) -> Option<Instant> {
        self.lock().newest.as_ref().map(|newest| newest.arrived)
    }

    fn put(&self, picture: Picture) {
        let mut kept = self.lock();
        if kept.waiting.len() >= self.queue {
            kept.waiting.pop_front();
            self.counts.skipped.fetch_add(1, Ordering::Relaxed);
        }
        kept.waiting.push_back(picture.clone());
        kept.newest = Some(picture);
        drop(kept);
        self.changed.notify_all();
    }
}

/// Receives pictures until it is dropped.
pub(super) struct PictureReader {
    pub(super) shared: Arc<Shared>,
    pub(super) topic: String,
    thread: Option<JoinHandle<()>>,
}

impl PictureReader {
    pub(super) fn open(
        node: &mut Node,
        is_compressed: bool,
        qos: Qos,
        queue: usize,
        lines: &Arc<Lines>,
    ) -> Result<Self, RosError> {
        if is_compressed {
            Self::spawn(node.subscribe("image/compressed", qos)?, queue, lines, |message: &CompressedImage| {
                (message.header.clone(), encoding::read_compressed(message))
            })
        } else {
            Self::spawn(node.subscribe("image", qos)?, queue, lines, |message: &Image| {
                (message.header.clone(), encoding::read_image(message))
            })
        }
    }

    fn spawn<T: Message + Send + 'static>(
        subscription: Subscription<T>,
        queue: usize,
        lines: &Arc<Lines>,
        read: fn(&T) -> (Header, Result<RgbImage, PictureError>),
    ) -> Result<Self, RosError> {
        let shared = Arc::new(Shared::new(queue));
        let topic = subscription.topic().to_owned();
        let (writer, lines) = (Arc::clone(&shared), Arc::clone(lines));
        let receive = move || {
            while !writer.is_stopped.load(Ordering::SeqCst) {
                let received = subscription.receive(POLL_INTERVAL);
                writer.counts.lost.store(subscription.num_lost(), Ordering::Relaxed);
                match received {
                    Ok(Some(received)) => take(&writer, &lines, subscription.topic(), &received, read),
                    Ok(None) => {}
                    Err(error @ RosError::ClockSetBack { .. }) => {
                        let _ = writer.ended.set(error);
                        return;
                    }
                    Err(error) => {
                        writer.counts.refused.fetch_add(1, Ordering::Relaxed);
                        lines.complain(&error.to_string());
                    }
                }
            }
        };
        let thread = network_thread("pictures", receive)?;
        Ok(Self { shared, topic, thread: Some(thread) })
    }
}

fn take<T>(
    shared: &Shared,
    lines: &Lines,
    topic: &str,
    received: &Received<T>,
    read: fn(&T) -> (Header, Result<RgbImage, PictureError>),
) {
    match read(&received.message) {
        (header, Ok(picture)) => {
            shared.counts.received.fetch_add(1, Ordering::Relaxed);
            let captured = stamp_or_now(header.stamp);
            shared.put(Picture { header, picture: Arc::new(picture), arrived: received.arrived, captured });
        }
        (_, Err(why)) => {
            shared.counts.refused.fetch_add(1, Ordering::Relaxed);
            lines.complain(&RosError::Picture { topic: topic.to_owned(), why }.to_string());
        }
    }
}

impl Drop for PictureReader {
    fn drop(&mut self) {
        self.shared.is_stopped.store(true, Ordering::SeqCst);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}
