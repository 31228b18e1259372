//! Detection in a camera's frames: in each frame independently, or with tracking across frames.

use std::cmp::Ordering;
use std::sync::Arc;
use std::time::{Duration, SystemTime};

use image::RgbImage;
use sdg_camera::{Address, Camera, CameraError, Frame, LatestFrame};
use sdg_grasp::{TrackState, TrackerConfig, Verification};

use crate::error::Result;
use crate::live_tracker::{LiveTracker, SearchTime};
use crate::perception::{Found, Perception};

/// Maximum wait for the newest frame.
const MAX_WAIT: Duration = Duration::from_millis(200);

/// The frames of a camera. A stream gives only its newest frame. A simulated camera and a camera that delivers pictures
/// on request give every frame.
pub enum Frames {
    /// The newest frame. Frames that were not read in time are dropped.
    Newest(LatestFrame),
    /// Every frame in order.
    Each(Box<dyn Camera>),
}

/// Result of reading a camera.
#[derive(Debug)]
pub enum Next {
    /// A frame.
    Frame(Frame),
    /// No frame yet.
    None,
    /// There are no further frames.
    End,
    /// A fault of the camera.
    Error(CameraError),
}

impl Frames {
    /// The frames of an open camera.
    pub fn of(camera: Box<dyn Camera>, address: &Address) -> Self {
        match address {
            Address::Sim(_) => Self::Each(camera),
            _ if camera.is_on_request() => Self::Each(camera),
            _ => Self::Newest(LatestFrame::spawn(camera)),
        }
    }

    /// Whether frames are produced only on request.
    pub fn wait(&self) -> bool {
        matches!(self, Self::Each(camera) if camera.is_on_request())
    }

    /// The next frame. Waits at most 0.2 s for a stream's newest frame.
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

/// A part in a frame and its track.
#[derive(Debug, Clone)]
pub struct Part {
    /// The detection.
    pub found: Found,
    /// Number and state of the track, and the time since the part was first found.
    pub track: Option<(u64, TrackState, Duration)>,
}

impl Part {
    /// The order of parts in outputs: decreasing scores, as of the detections in a picture.
    pub fn by_score(&self, other: &Self) -> Ordering {
        other.found.detection.score.total_cmp(&self.found.detection.score)
    }

    /// Whether the part is visible in this frame.
    pub fn is_seen(&self, min_score: f64) -> bool {
        match self.track {
            Some((_, state, _)) => state != TrackState::Lost,
            None => self.found.detection.score >= min_score,
        }
    }
}

/// Detects the parts of a frame, with or without previous frames.
pub struct FrameDetector {
    detector: Perception,
    verification: Verification,
    tracker: Option<LiveTracker>,
    /// The time between stored pictures; `None` if frames have their own times.
    interval: Option<Duration>,
    clock: FrameClock,
}

/// Interval for pictures that may be unrelated: stored pictures without a frame rate, and those before and after a
/// clock was set back.
const UNRELATED: Duration = Duration::from_secs(1);

/// The time since a camera's first frame, which never goes back.
#[derive(Debug, Default)]
struct FrameClock {
    last: Option<SystemTime>,
    since_first: Duration,
}

impl FrameClock {
    /// The time at a frame that was captured at `captured` by the system's clock, which may have been set back.
    fn at(&mut self, captured: SystemTime) -> Duration {
        let last = self.last.replace(captured).unwrap_or(captured);
        self.since_first = self.since_first.saturating_add(captured.duration_since(last).unwrap_or(UNRELATED));
        self.since_first
    }
}

impl FrameDetector {
    /// Creates a detector. `tracking` configures tracking; `None` searches each frame independently. `frames_wait` is
    /// true if frames are produced only on request.
    ///
    /// # Errors
    /// The operating system provides no thread.
    pub fn new(
        detector: Perception,
        verification: Verification,
        tracking: Option<TrackerConfig>,
        address: &Address,
        frames_wait: bool,
    ) -> Result<Self> {
        // The modification time of a file is not the capture time of its picture.
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
            LiveTracker::new(&detector, config, SearchTime::AsItTakes { threads: None })
        };
        let tracker = tracking.map(follow).transpose()?;
        Ok(Self { detector, verification, tracker, interval, clock: FrameClock::default() })
    }

    /// The parts in a frame: by decreasing score, or with tracking by the number of their tracks.
    ///
    /// # Errors
    /// The picture's size differs from the camera's, or detection fails.
    pub fn find(&mut self, picture: &Arc<RgbImage>, frame: &Frame) -> Result<Vec<Part>> {
        self.detector.check_picture(picture)?;
        let Some(tracker) = &mut self.tracker else {
            let found = self.detector.detect(picture, self.verification)?;
            return Ok(found.into_iter().map(|found| Part { found, track: None }).collect());
        };
        let since = match self.interval {
            Some(interval) => interval.mul_f64(frame.number as f64),
            None => self.clock.at(frame.captured),
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
    /// The perception used for detection.
    pub fn perception(&self) -> &Perception {
        &self.detector
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clock_that_is_set_back_goes_on_with_an_unrelated_frame() {
        let mut clock = FrameClock::default();
        let times =
            [100.0, 101.0, 0.0, 0.03].map(|secs| clock.at(SystemTime::UNIX_EPOCH + Duration::from_secs_f64(secs)));
        assert_eq!(times, [0.0, 1.0, 2.0, 2.03].map(Duration::from_secs_f64));
        assert!(times[2] - times[1] > TrackerConfig::DEFAULT.search_every);
    }
}
