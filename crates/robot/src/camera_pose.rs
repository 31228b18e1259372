//! Where a camera is fixed.

use nalgebra::Isometry3;

/// Where a camera is fixed (optical frame); lengths in metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum CameraPose {
    /// On the hand: `flange_from_camera`.
    OnFlange(Isometry3<f64>),
    /// Beside the robot: `base_from_camera`.
    InBase(Isometry3<f64>),
}
