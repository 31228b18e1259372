//! The outcome of a grasp attempt.

use image::RgbImage;
use nalgebra::Isometry3;
use sdg_robot::{GraspOutcome, GraspStep, GraspTarget};

use crate::objects::GraspError;

/// All that happened in an attempt.
#[derive(Debug, Clone)]
pub struct AttemptReport {
    /// How it ended: held where, after lifting and waiting, the part hung high enough between both fingers.
    pub outcome: GraspOutcome,
    /// The seed of the start configuration.
    pub seed: u64,
    /// Where the part lay at the start, in the base frame.
    pub base_from_object: Option<Isometry3<f64>>,
    /// The target that perception gave at each look, where its score was high enough: from afar until the part was found, then from above it.
    pub targets: Vec<Option<GraspTarget>>,
    /// How many looks there were from afar, and how many from above what they found: one each where the part was found
    /// at the first look.
    pub looks: [usize; 2],
    /// How far the part really lies beside the place where it was put down, where it was to be.
    pub place_error: Option<GraspError>,
    /// How far the hand swung to either side after lifting, in metres; `None` where it was not shaken.
    pub shake_amplitude_m: Option<f64>,
    /// The same by the hand's width and force, after each of the last steps; see [`sdg_robot::GraspReport`].
    pub hand_verdicts: Vec<(GraspStep, Option<String>)>,
    /// Height of the part's lowest point above the table at the end, in metres.
    pub object_height_m: Option<f64>,
    /// Simulated time in seconds.
    pub simulated_secs: f64,
    /// Time that it took, in seconds, perception included.
    pub wall_secs: f64,
    /// Pictures from outside, if recorded.
    pub frames: Vec<RgbImage>,
}
