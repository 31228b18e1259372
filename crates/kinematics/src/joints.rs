//! Joint positions of the arm: their type, Franka's ready pose, and positions outside their range.

use nalgebra::SVector;

/// Number of joints of the arm.
pub const NUM_JOINTS: usize = 7;

/// One number for each joint, from joint 1 at the base; radians unless stated otherwise.
pub type JointVector = SVector<f64, NUM_JOINTS>;

/// Franka's ready pose, rad: elbow up, hand pointing down in front of the base.
pub const READY_RAD: [f64; NUM_JOINTS] = {
    use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};
    [0.0, -FRAC_PI_4, 0.0, -3.0 * FRAC_PI_4, 0.0, FRAC_PI_2, FRAC_PI_4]
};

/// Franka's ready pose as a vector, see [`READY_RAD`].
pub fn ready_pose() -> JointVector {
    JointVector::from(READY_RAD)
}

/// A joint position outside its range.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LimitViolation {
    /// Joint number from 1 to 7, as Franka counts.
    pub joint: usize,
    /// The requested position, rad.
    pub found_rad: f64,
    /// Smallest allowed position, rad.
    pub min_rad: f64,
    /// Largest allowed position, rad.
    pub max_rad: f64,
}

impl LimitViolation {
    /// Distance of the position from its range, rad, positive.
    pub fn excess_rad(&self) -> f64 {
        (self.min_rad - self.found_rad).max(self.found_rad - self.max_rad)
    }
}
