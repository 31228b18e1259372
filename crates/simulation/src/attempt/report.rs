//! The outcome of a grasp attempt.

use image::RgbImage;
use nalgebra::Isometry3;
use sdg_robot::{GraspOutcome, GraspStep, GraspTarget};

use crate::objects::GraspError;

/// The record of an attempt.
#[derive(Debug, Clone)]
pub struct AttemptReport {
    /// The outcome: held if the part was high enough and between both fingers after lifting and waiting. A part that
    /// was to be put down must also be at its place.
    pub outcome: GraspOutcome,
    /// The seed of the start configuration.
    pub seed: u64,
    /// The part's pose at the start, in the base frame.
    pub base_from_object: Option<Isometry3<f64>>,
    /// The accepted detection of each picture: from look-out poses until the part was found, then from above it. The
    /// last target is that at the part's height, if this height was determined.
    pub targets: Vec<Option<GraspTarget>>,
    /// Whether a picture was taken and did not contain the part.
    pub found_nothing: bool,
    /// Numbers of pictures from look-out poses and from above the detection: one each if the first pictures show the
    /// part.
    pub looks: [usize; 2],
    /// The true offset of the part from its place, if it was to be put down.
    pub place_error: Option<GraspError>,
    /// Amplitude of the hand's swing after lifting, in metres; `None` if the hand was not shaken.
    pub shake_amplitude_m: Option<f64>,
    /// The verdict of the hand's width and force after closing, lifting and holding; see [`sdg_robot::GraspReport`].
    pub hand_verdicts: Vec<(GraspStep, Option<String>)>,
    /// Height of the part's lowest point above the table at the end, in metres.
    pub object_height_m: Option<f64>,
    /// Simulated time in seconds.
    pub simulated_secs: f64,
    /// Duration of the attempt by the computer's clock, in seconds, including perception.
    pub wall_secs: f64,
    /// Pictures from outside, if recorded.
    pub frames: Vec<RgbImage>,
}
