//! One picture of a hand-eye calibration, and how the camera is mounted.

use nalgebra::Isometry3;

use crate::detection::SeenCorner;

/// With three pictures nothing is left when one is taken away.
pub const MIN_POSES: usize = 4;

/// What the camera is fixed to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mount {
    /// To the flange: eye-in-hand. The board lies still.
    Hand,
    /// To the robot's base or the room: eye-to-hand. The flange holds the board.
    Base,
}

impl Mount {
    /// `A_i`.
    pub(super) fn motion(self, base_from_flange: &Isometry3<f64>) -> Isometry3<f64> {
        match self {
            Self::Hand => base_from_flange.inverse(),
            Self::Base => *base_from_flange,
        }
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
