//! One picture of a hand-eye calibration.

use nalgebra::Isometry3;
use sdg_geometry::Mount;

use crate::detection::SeenCorner;

/// Minimum number of pictures. With three, none could be left out.
pub const MIN_POSES: usize = 4;

/// The motion `A_i`. With the camera on the hand, the board is at rest; with the camera beside the robot, the flange
/// holds the board.
pub(super) fn motion(mount: Mount, base_from_flange: &Isometry3<f64>) -> Isometry3<f64> {
    match mount {
        Mount::Hand => base_from_flange.inverse(),
        Mount::Base => *base_from_flange,
    }
}

/// A robot's pose and the corners in the picture taken there.
#[derive(Debug, Clone, PartialEq)]
pub struct HandEyeView {
    /// The pose of the flange according to the robot, in metres.
    pub base_from_flange: Isometry3<f64>,
    /// The visible corners of the board.
    pub corners: Vec<SeenCorner>,
}
