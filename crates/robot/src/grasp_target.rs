//! A grasp from perception.

use nalgebra::Isometry3;

/// The grasp pose from perception.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GraspTarget {
    /// Pose of the tool centre point when the hand closes, in the base frame, metres: z points into the table, y along
    /// the fingers' motion.
    pub base_from_tcp: Isometry3<f64>,
    /// Width of the part between the fingers, in metres.
    pub jaw_width_m: f64,
    /// Score of perception, 0 to 1; the threshold is 0.5.
    pub score: f64,
}
