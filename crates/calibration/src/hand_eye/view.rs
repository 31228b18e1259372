//! One picture of a hand-eye calibration.

use nalgebra::Isometry3;
use sdg_geometry::Mount;

use crate::detection::SeenCorner;

/// With three pictures nothing is left when one is taken away.
pub const MIN_POSES: usize = 4;

/// `A_i`. On the hand the board lies still; beside the robot the flange holds it.
pub(super) fn motion(mount: Mount, base_from_flange: &Isometry3<f64>) -> Isometry3<f64> {
    match mount {
        Mount::Hand => base_from_flange.inverse(),
        Mount::Base => *base_from_flange,
    }
}

/// A robot's pose and the corners seen from there.
#[derive(Debug, Clone, PartialEq)]
pub struct HandEyeView {
    /// Where the robot says that its flange is, in metres.
    pub base_from_flange: Isometry3<f64>,
    /// What the picture shows of the board.
    pub corners: Vec<SeenCorner>,
}
