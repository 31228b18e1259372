//! Parts tracked from frame to frame.

use std::mem;
use std::process;
use std::sync::Arc;
use std::time::Duration;

use image::RgbImage;
use sdg_cell::{Found, FoundRecord, LiveTracker, PartRecord, Perception, SearchTime, track_state_name};
use sdg_grasp::{GraspDetection, TrackedPart, TrackerConfig};

use crate::fault::{Fault, FaultKind, Result};
use crate::model::{Model, View};
use crate::threads::on_threads;

/// A tracker for one camera's frames; searches run on a separate thread, or on the caller's with `search_frames`.
pub struct Tracker {
    perception: Arc<Perception>,
    /// `None` after the tracker was closed.
    tracker: Option<LiveTracker>,
    /// Id of the process that has the search thread.
    pid: u32,
    threads: Option<usize>,
    /// The times of the first and the last frame; `None` before the first.
    times_secs: Option<[f64; 2]>,
}

impl Tracker {
    /// Makes a tracker without known parts. With `search_frames`, a search's result is used this number of frames
    /// later, identically on every machine; otherwise as soon as the search has ended.
    ///
    /// # Errors
    /// The errors of [`Model::perception`]; the number of threads is invalid, or the system refuses them; the process
    /// was forked from one with threads of this library.
    pub fn new(model: &Model, view: &View, search_frames: Option<u32>) -> Result<Self> {
        let perception = on_threads(view.threads, || model.perception(view.camera.as_ref(), view.region))??;
        let as_it_takes = SearchTime::AsItTakes { threads: view.threads };
        let search_time = search_frames.map_or(as_it_takes, SearchTime::Frames);
        let tracker = LiveTracker::new(&perception, TrackerConfig::DEFAULT, search_time)?;
        Ok(Self { perception, tracker: Some(tracker), pid: process::id(), threads: view.threads, times_secs: None })
    }

    /// The parts in a frame as JSON, with the fields of `sdg detect --from --json`; `captured_secs` is measured from
    /// any fixed time.
    ///
    /// # Errors
    /// The tracker was closed; the time is not finite or before that of the last frame; the picture's size differs from
    /// the camera's, or the region is not inside the picture; a search fails; the errors of threads as for
    /// [`Model::detect`].
    pub fn frame(&mut self, picture: RgbImage, captured_secs: f64) -> Result<String> {
        let Some(tracker) = self.tracker.as_mut() else {
            return Err(Fault::new(FaultKind::Closed, "expected a tracker that is open, found one that was closed"));
        };
        let refused = |expected: String| {
            Fault::new(FaultKind::Argument, format!("expected captured_s {expected}, found {captured_secs}"))
        };
        if !captured_secs.is_finite() {
            return Err(refused("to be finite".to_owned()));
        }
        let [first_secs, last_secs] = self.times_secs.unwrap_or([captured_secs; 2]);
        if captured_secs < last_secs {
            return Err(refused(format!("of at least {last_secs}, the previous frame's")));
        }
        let captured = Duration::try_from_secs_f64(captured_secs - first_secs)
            .map_err(|_| refused(format!("less than 2^64 seconds after {first_secs}, the first frame's")))?;
        self.perception.check_picture(&picture)?;
        let parts = on_threads(self.threads, || tracker.frame(Arc::new(picture), captured))??;
        self.times_secs = Some([first_secs, captured_secs]);
        let detections: Vec<&GraspDetection> = parts.iter().map(|part| &part.detection).collect();
        let touched = self.perception.touched_among_accepted(&detections, |idx| parts[idx].is_followed());
        let record = |(part, jaws_touch): (TrackedPart, Vec<usize>)| PartRecord {
            track: Some(part.id),
            state: Some(track_state_name(part.state)),
            age_s: Some(part.age.as_secs_f64()),
            found: FoundRecord::new(&Found { detection: part.detection, pose: part.pose }, &self.perception),
            jaws_touch,
        };
        let records: Vec<PartRecord> = parts.into_iter().zip(touched).map(record).collect();
        Ok(serde_json::to_string(&records).unwrap_or_default())
    }

    /// Closes the tracker; waits for a running search.
    pub fn close(&mut self) {
        let tracker = self.tracker.take();
        if self.pid != process::id() {
            // The search thread does not exist in a forked process, so waiting for its end would fail.
            mem::forget(tracker);
        }
    }
}

impl Drop for Tracker {
    fn drop(&mut self) {
        self.close();
    }
}
