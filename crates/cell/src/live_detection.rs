//! Detection in a camera's frames: each on its own, or parts followed from frame to frame.

use std::sync::Arc;
use std::time::{Duration, SystemTime};

use image::RgbImage;
use sdg_camera::{Address, Camera, CameraError, Frame, LatestFrame};
use sdg_grasp::{TrackState, TrackerConfig, Verification};

use crate::error::Result;
use crate::live_tracker::{LiveTracker, SearchTime};
use crate::perception::{Found, Perception};

/// How long the newest frame is waited for.
const MAX_WAIT: Duration = Duration::from_millis(200);

/// The frames of a camera: of a stream the newest, of stored and rendered pictures and of those on request each.
pub enum Frames {
    /// What has not been taken is replaced by newer ones.
    Newest(LatestFrame),
    /// One after the other.
    Each(Box<dyn Camera>),
}

/// What a camera gave.
#[derive(Debug)]
pub enum Next {
    /// A frame.
    Frame(Frame),
    /// None yet.
    None,
    /// There will be none any more.
    End,
    /// A fault of the camera.
    Error(CameraError),
}

impl Frames {
    /// Those of a camera that is open.
    pub fn of(camera: Box<dyn Camera>, address: &Address) -> Self {
        match address {
            Address::Sim(_) => Self::Each(camera),
            _ if camera.is_on_request() => Self::Each(camera),
            _ => Self::Newest(LatestFrame::spawn(camera)),
        }
    }

    /// Whether none comes before it is asked for.
    pub fn wait(&self) -> bool {
        matches!(self, Self::Each(camera) if camera.is_on_request())
    }

    /// The next one, waited for a moment.
    pub fn take(&mut self) -> Next {
        match self {
            Self::Newest(newest) => match newest.take(MAX_WAIT) {
                Ok(Some(frame)) => Next::Frame(frame),
                Ok(None) if newest.has_ended() => Next::End,
                Ok(None) => Next::None,
                Err(error) => Next::Error(error),
            },
            Self::Each(camera) => match camera.next_frame() {
                Ok(Some(frame)) => Next::Frame(frame),
                Ok(None) => Next::End,
                Err(error) => Next::Error(error),
            },
        }
    }
}

/// A part in a frame, and which track it is of.
#[derive(Debug, Clone)]
pub struct Part {
    /// Where it is.
    pub found: Found,
    /// Number and state of its track, and the time since it was seen.
    pub track: Option<(u64, TrackState, Duration)>,
}

impl Part {
    /// Whether it is there in this frame.
    pub fn is_seen(&self, min_score: f64) -> bool {
        match self.track {
            Some((_, state, _)) => state != TrackState::Lost,
            None => self.found.detection.score >= min_score,
        }
    }
}

/// Parts of a frame, with or without those of the frames before.
pub struct FrameDetector {
    detector: Perception,
    verification: Verification,
    tracker: Option<LiveTracker>,
    /// The time from one stored picture to the next; `None` where frames have times of their own.
    interval: Option<Duration>,
    /// What frame times are counted from.
    first: Option<SystemTime>,
}

/// Between stored pictures that are played without a rate: nothing says that one follows from the other.
const UNRELATED: Duration = Duration::from_secs(1);

impl FrameDetector {
    /// `tracking` is how parts are followed, or nothing where each frame is searched on its own; `frames_wait` where none comes before it is
    /// asked for.
    ///
    /// # Errors
    /// A model that cannot be followed.
    pub fn new(
        detector: Perception,
        verification: Verification,
        tracking: Option<TrackerConfig>,
        address: &Address,
        frames_wait: bool,
    ) -> Result<Self> {
        // The time of a file's last change is not that of its picture.
        let interval = match address {
            Address::Folder { playback, .. } | Address::File { playback, .. } => {
                Some(playback.interval.unwrap_or(UNRELATED))
            }
            _ => None,
        };
        let follow = |mut config: TrackerConfig| {
            if frames_wait {
                config.moves_within = Duration::ZERO;
            }
            LiveTracker::new(&detector, config, SearchTime::AsItTakes)
        };
        let tracker = tracking.map(follow).transpose()?;
        Ok(Self { detector, verification, tracker, interval, first: None })
    }

    /// The parts in a frame.
    ///
    /// # Errors
    /// A picture of another size than the camera's, and errors of detection.
    pub fn find(&mut self, picture: &Arc<RgbImage>, frame: &Frame) -> Result<Vec<Part>> {
        self.detector.check_picture(picture)?;
        let Some(tracker) = &mut self.tracker else {
            let found = self.detector.detect(picture, self.verification)?;
            return Ok(found.into_iter().map(|found| Part { found, track: None }).collect());
        };
        let first = *self.first.get_or_insert(frame.captured);
        let since = match self.interval {
            Some(interval) => interval.mul_f64(frame.number as f64),
            None => frame.captured.duration_since(first).unwrap_or_default(),
        };
        let parts = tracker.frame(Arc::clone(picture), since)?;
        let part = |part: sdg_grasp::TrackedPart| Part {
            track: Some((part.id, part.state, part.age)),
            found: Found { detection: part.detection, pose: part.pose },
        };
        Ok(parts.into_iter().map(part).collect())
    }
}

impl FrameDetector {
    /// What it detects with.
    pub fn perception(&self) -> &Perception {
        &self.detector
    }
}
