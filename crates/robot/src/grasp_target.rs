//! A grasp as perception tells it.

use nalgebra::Isometry3;

/// Where the hand should close, as perception sees it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GraspTarget {
    /// Pose of the tool centre point when closing, in the base frame, metres: z into the table, y
    /// along the fingers' motion.
    pub base_from_tcp: Isometry3<f64>,
    /// Width of the part between the fingers, in metres.
    pub jaw_width_m: f64,
    /// How sure perception is, 0 to 1; 0.5 is where to decide.
    pub score: f64,
}
