//! What came of a grasp attempt.

use std::fmt;

use image::RgbImage;
use nalgebra::Isometry3;

use crate::camera::CameraView;
use crate::perception::GraspTarget;

/// A step of an attempt.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum AttemptStep {
    /// Perception finds the part.
    Detect,
    /// The arm goes over the part and turns to it.
    Hover,
    /// The hand comes down to the part.
    Approach,
    /// The fingers close on it.
    Close,
    /// The arm lifts it.
    Lift,
    /// The part stays between the fingers.
    Hold,
}

impl fmt::Display for AttemptStep {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Detect => "detect",
            Self::Hover => "hover",
            Self::Approach => "approach",
            Self::Close => "close",
            Self::Lift => "lift",
            Self::Hold => "hold",
        })
    }
}

/// How an attempt ended.
#[derive(Debug, Clone, PartialEq)]
pub enum AttemptOutcome {
    /// One second after lifting, the part hung high enough between both fingers.
    Success,
    /// It did not come so far.
    Failure {
        /// The step that failed.
        step: AttemptStep,
        /// Why, in one sentence.
        why: String,
    },
}

impl AttemptOutcome {
    /// Whether the part was grasped.
    pub fn is_success(&self) -> bool {
        *self == Self::Success
    }
}

/// All that happened in an attempt.
#[derive(Debug, Clone)]
pub struct AttemptReport {
    /// How it ended.
    pub outcome: AttemptOutcome,
    /// The seed of the start configuration.
    pub seed: u64,
    /// Where the part lay at the start, in the base frame.
    pub base_from_object: Option<Isometry3<f64>>,
    /// What the wrist camera saw, look by look: from afar until the part was found, then from above it.
    pub views: Vec<CameraView>,
    /// What perception said to each of the views, where it was sure enough.
    pub targets: Vec<Option<GraspTarget>>,
    /// How many looks there were from afar, and how many from above what they found: one each where the part was found
    /// at the first look.
    pub looks: [usize; 2],
    /// How far the hand swung to either side after lifting, in metres; `None` where it was not shaken.
    pub shake_amplitude_m: Option<f64>,
    /// Height of the part's lowest point above the table at the end, in metres.
    pub object_height_m: Option<f64>,
    /// Simulated time in seconds.
    pub simulated_secs: f64,
    /// Time that it took, in seconds, perception included.
    pub wall_secs: f64,
    /// Of that, time in perception, in seconds.
    pub perception_secs: f64,
    /// Pictures from outside, if recorded.
    pub frames: Vec<RgbImage>,
}
