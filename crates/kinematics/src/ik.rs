//! Preferences and results of inverse kinematics.

use nalgebra::Isometry3;

use crate::joints::JointVector;

/// Preferences of [`ArmGeometry::inverse`](crate::ArmGeometry::inverse) among the configurations that reach a pose.
///
/// The cost is `seed_weight · |q - seed|² + posture_weight · |q - posture|² + limit_weight · Σ max(0, 1 - margin /
/// comfortable_margin_rad)²`, with angles in rad.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct IkOptions {
    /// Weight of the distance to the seed configuration; it favours short motions.
    pub seed_weight: f64,
    /// The preferred posture, rad; `None` for the arm's ready posture.
    pub posture: Option<JointVector>,
    /// Weight of the distance to the preferred posture.
    pub posture_weight: f64,
    /// Weight of closeness to joint limits.
    pub limit_weight: f64,
    /// Distance from a limit below which a joint adds to the cost, rad.
    pub comfortable_margin_rad: f64,
    /// Minimum distance of joint positions from their limits, rad.
    pub required_margin_rad: f64,
    /// Number of angles of joint 7 that are tried in addition to those of seed and posture, at least 2.
    pub num_redundancy_samples: usize,
    /// Tolerance of the position, m.
    pub position_tolerance_m: f64,
    /// Tolerance of the orientation, rad.
    pub angle_tolerance_rad: f64,
    /// Length in metres that counts as much as a radian in the search for the reachable pose nearest to an unreachable
    /// one.
    pub metres_per_rad: f64,
}

impl Default for IkOptions {
    fn default() -> Self {
        Self {
            seed_weight: 1.0,
            posture: None,
            posture_weight: 0.3,
            limit_weight: 2.0,
            comfortable_margin_rad: 0.3,
            required_margin_rad: 0.0,
            num_redundancy_samples: 64,
            position_tolerance_m: 1e-6,
            angle_tolerance_rad: 1e-6,
            metres_per_rad: 0.3,
        }
    }
}

/// A configuration and its deviation from the requested pose.
#[derive(Debug, Clone, PartialEq)]
pub struct IkSolution {
    /// Joint positions within the limits, rad.
    pub q: JointVector,
    /// The tcp pose that `q` reaches.
    pub base_from_tcp: Isometry3<f64>,
    /// Distance between the reached and the requested position, m.
    pub position_residual_m: f64,
    /// Angle between the reached and the requested orientation, rad.
    pub angle_residual_rad: f64,
    /// Smallest distance of a joint from one of its limits, rad.
    pub limit_margin_rad: f64,
    /// The cost as in [`IkOptions`]; lower is better.
    pub cost: f64,
}
