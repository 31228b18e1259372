//! Tracks parts through live pictures: tracking runs on the caller's thread, searches on another one.
//!
//! ```text
//! frame ─ LiveTracker::frame ─ Tracker: follow ─────────────────────────── TrackedPart…
//!                                │ search due ─ channel ─ search thread ─ channel ─ result used before the next frame
//!                                └ not continuous with the previous frame: searched at once, on the caller's thread
//! ```
//! So a frame waits for at most one search, while another search may run on the search thread.
//!
//! The duration of a search varies, and its result is moved to the current frame. For reproducible tests,
//! [`SearchTime::Frames`] runs each search on the caller's thread and delivers its result a fixed number of frames
//! later.

use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, TryRecvError, channel};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use image::RgbImage;
use rayon::ThreadPoolBuilder;
use sdg_grasp::{PartSearch, SearchOutcome, TrackedPart, Tracker, TrackerConfig};

use crate::error::{CellError, Result};
use crate::perception::Perception;

const ENDED: CellError = CellError::SearchThread("ended");
const DOES_NOT_START: CellError = CellError::SearchThread("does not start");

/// The thread and timing of searches.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SearchTime {
    /// On a separate thread, with their real durations.
    AsItTakes {
        /// Number of threads of a search; `None` for one per core.
        threads: Option<usize>,
    },
    /// On the caller's thread. The tracker gets the result this number of frames after the searched one, at least one
    /// frame later.
    Frames(u32),
}

/// A tracker with its searches.
pub struct LiveTracker {
    tracker: Tracker,
    searches: Searches,
}

enum Searches {
    Threaded {
        /// The channel to the search thread; `None` when the thread must end.
        due: Option<Sender<PartSearch>>,
        done: Receiver<SearchOutcome>,
        thread: Option<JoinHandle<()>>,
    },
    Delayed {
        frames: u32,
        /// The result of the search, and the number of frames until it is delivered.
        outcome: Option<(SearchOutcome, u32)>,
    },
}

impl LiveTracker {
    /// Creates a tracker without known parts. [`SearchTime::AsItTakes`] also starts the search thread.
    ///
    /// # Errors
    /// The operating system provides no threads.
    pub fn new(perception: &Perception, config: TrackerConfig, search_time: SearchTime) -> Result<Self> {
        let searches = match search_time {
            SearchTime::AsItTakes { threads } => {
                let pool = threads.map(|count| ThreadPoolBuilder::new().num_threads(count).build()).transpose();
                let pool = pool.map_err(|_| DOES_NOT_START)?;
                let (due, searches) = channel::<PartSearch>();
                let (finished, done) = channel();
                let work = move || {
                    while let Some(search) = newest(&searches) {
                        let outcome = match &pool {
                            Some(pool) => pool.install(|| search.run()),
                            None => search.run(),
                        };
                        if finished.send(outcome).is_err() {
                            break;
                        }
                    }
                };
                let thread = thread::Builder::new().name("search".to_owned()).spawn(work);
                let thread = thread.map_err(|_| DOES_NOT_START)?;
                Searches::Threaded { due: Some(due), done, thread: Some(thread) }
            }
            SearchTime::Frames(frames) => Searches::Delayed { frames: frames.max(1), outcome: None },
        };
        Ok(Self { tracker: Tracker::new(perception.to_part_detector(), config), searches })
    }

    /// Tracks all known parts in a frame. A frame that does not continue the previous one is searched first; otherwise
    /// due searches run as [`SearchTime`] defines. `captured` is measured from any fixed time.
    ///
    /// # Errors
    /// Errors of a search, for example a picture that is too small; or the search thread has ended.
    pub fn frame(&mut self, picture: Arc<RgbImage>, captured: Duration) -> Result<Vec<TrackedPart>> {
        if let Some(outcome) = self.searches.finished()? {
            self.tracker.take_outcome(outcome)?;
        }
        let parts = self.tracker.frame(picture, captured);
        if let Some(search) = self.tracker.search_before_answer() {
            return Ok(self.tracker.answer(search.run())?);
        }
        if let Some(search) = self.tracker.search_due() {
            self.searches.start(search)?;
        }
        Ok(parts)
    }
}

impl Searches {
    /// The result that must be delivered before the next frame.
    fn finished(&mut self) -> Result<Option<SearchOutcome>> {
        match self {
            Self::Threaded { done, .. } => match done.try_recv() {
                Ok(outcome) => Ok(Some(outcome)),
                Err(TryRecvError::Empty) => Ok(None),
                Err(TryRecvError::Disconnected) => Err(ENDED),
            },
            Self::Delayed { outcome, .. } => {
                if let Some((_, frames)) = outcome {
                    *frames -= 1;
                }
                Ok(outcome.take_if(|(_, frames)| *frames == 0).map(|(outcome, _)| outcome))
            }
        }
    }

    fn start(&mut self, search: PartSearch) -> Result<()> {
        match self {
            Self::Threaded { due, .. } => {
                let sent = due.as_ref().map(|due| due.send(search));
                if !matches!(sent, Some(Ok(()))) {
                    return Err(ENDED);
                }
            }
            Self::Delayed { frames, outcome } => *outcome = Some((search.run(), *frames)),
        }
        Ok(())
    }
}

/// Waits for a search and returns the newest one; `None` if no more will come. The tracker requests a search only when
/// it waits for none, so it abandoned the earlier ones. With their pictures they would fill the channel of a busy
/// machine.
fn newest<T>(searches: &Receiver<T>) -> Option<T> {
    let first = searches.recv().ok()?;
    Some(searches.try_iter().last().unwrap_or(first))
}

impl Drop for LiveTracker {
    /// Waits for a running search.
    fn drop(&mut self) {
        if let Searches::Threaded { due, thread, .. } = &mut self.searches {
            due.take();
            if let Some(thread) = thread.take() {
                // If a search panicked, its message was already printed.
                let _ = thread.join();
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_newest_of_the_waiting_searches_is_run() {
        let (due, searches) = channel();
        for number in 0..3 {
            due.send(number).unwrap();
        }
        assert_eq!(newest(&searches), Some(2));
        due.send(3).unwrap();
        drop(due);
        assert_eq!(newest(&searches), Some(3));
        assert_eq!(newest(&searches), None);
    }
}
