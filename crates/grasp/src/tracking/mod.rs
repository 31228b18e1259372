//! Parts followed through a sequence of pictures.
//!
//! ```text
//! frame n ─┬─ each track: pose carried forward by its velocity ─ window around it ─ edges ─ score ─ followed or lost
//!          │                                                                                          ↑
//!          ├─ now and then: PartSearch, on another core ─ detections in frame n ─ carried forward ────┤
//!          │                                              through the frames since, or matched to tracks
//!          └─ does not continue frame n - 1: PartSearch, before frame n is answered ──────────────────┘
//! ```
//! **Glossary.** *Searched image*: the picture or its plan view; poses are in its pixels.
//! *Followed*: refined near the last pose, in a window; nothing outside the window is read. *Captured*: followed with a
//! wider reach, about five times slower. *Held*: kept at the pose of the last search, because the part has not moved
//! since. *Carried forward*: a detection in an older frame is followed through the later frames up to the newest.
//!
//! A followed track is scored in every frame like a detection ([`crate::Contributions`]), with two differences. A held
//! track keeps the score of its last search. The close look, which takes the most time, is made only in searches, and
//! if the last one is older than a second or the agreement of edges and surface has changed since. A track whose score
//! falls below [`TrackerConfig::lose_below`] is lost in that frame.
//!
//! This module deliberately has no clock and no thread. Frames carry their times, and the owner of the [`Tracker`]
//! decides where and when searches run. The same code therefore runs on two cores and in a browser, and gives the same
//! result in a test on any machine.

mod arrival;
mod continuity;
mod detector;
mod follow;
mod frames;
#[cfg(all(test, feature = "teach"))]
mod tests;
mod track;
mod tracker;

use std::time::Duration;

pub use self::detector::{PartDetector, PartSearch, SearchOutcome};
pub use self::tracker::Tracker;
use crate::detection::GraspDetection;
use crate::plan_view::PlanarPose;

/// The state of a track.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TrackState {
    /// The part was refined in this frame, and its score is high enough.
    Followed,
    /// As `Followed`, and the part was lost in the frame before.
    FoundAgain,
    /// The part was not confirmed in this frame; the detection is the last confirmed one.
    Lost,
}

/// A part in the newest frame.
#[derive(Debug, Clone, PartialEq)]
pub struct TrackedPart {
    /// Number of the part, which is kept while the part is followed and when it is found again.
    pub id: u64,
    /// Whether the part is at `detection`.
    pub state: TrackState,
    /// Time since the part was first found.
    pub age: Duration,
    /// Time since the part was last followed; zero while it is.
    pub unseen_for: Duration,
    /// The detection in pixels of the given picture, with the score in this frame; the last confirmed detection while
    /// the part is lost.
    pub detection: GraspDetection,
    /// The pose in metres, with a calibrated camera.
    pub pose: Option<PlanarPose>,
}

impl TrackedPart {
    /// Whether the part is followed in this frame.
    pub fn is_followed(&self) -> bool {
        self.state != TrackState::Lost
    }
}

/// The conditions under which parts are searched, lost and forgotten.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct TrackerConfig {
    /// Time between the starts of two searches while all known parts are followed; frames further apart continue each
    /// other only if they are equal. If a part is lost or none is known, searches run without a pause. Chosen by hand:
    /// a new part is found within this time plus that of a search.
    pub search_every: Duration,
    /// A track with a lower score is lost. The value is below 0.5, the threshold for detections, because the part was
    /// there in the last frame. Chosen by hand.
    pub lose_below: f64,
    /// Time after its loss during which a part is searched in every frame at the place predicted by its velocity.
    /// Chosen by hand.
    pub retry_for: Duration,
    /// A part lost for longer is forgotten; when found later, it is another part. Chosen by hand.
    pub forget_after: Duration,
    /// Maximum time between frames that always continue each other: a lost part or a change beside the followed parts
    /// counts as a movement, and the next regular search finds new parts. If more time has passed, a lost part or such
    /// a change causes a search before the frame is answered. Chosen by hand: just above the period of 30 frames per
    /// second. Zero if frames wait for the tracker.
    pub moves_within: Duration,
    /// Maximum number of parts that are followed at the same time. Chosen by hand to save time: each takes some
    /// milliseconds per frame.
    pub max_parts: usize,
}

impl TrackerConfig {
    /// The values of [`Default`], as a constant.
    pub const DEFAULT: Self = Self {
        search_every: Duration::from_millis(250),
        lose_below: 0.35,
        retry_for: Duration::from_millis(200),
        forget_after: Duration::from_secs(10),
        moves_within: Duration::from_millis(40),
        max_parts: 16,
    };
}

impl Default for TrackerConfig {
    fn default() -> Self {
        Self::DEFAULT
    }
}
