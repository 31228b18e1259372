//! The error type of this crate.

use crate::ik::IkSolution;
use crate::joints::LimitViolation;

/// Errors of this crate.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the messages say what the fields are")]
pub enum KinematicsError {
    /// An input contains NaN or infinity.
    #[error("{what} must be finite numbers, found {found}")]
    NotFinite { what: &'static str, found: String },
    /// A pose's quaternion is not of unit length.
    #[error("{what} must have a unit quaternion, found one of length {found}")]
    NotARotation { what: &'static str, found: f64 },
    /// An option is outside its range.
    #[error("{option} must be {expected}, found {found}")]
    InvalidOption { option: &'static str, expected: &'static str, found: f64 },
    /// A joint configuration is outside the position limits.
    #[error(
        "{what}: joint {} must lie in [{:.2}, {:.2}] degrees, found {:.2}",
        .violation.joint, .violation.min_rad.to_degrees(), .violation.max_rad.to_degrees(), .violation.found_rad.to_degrees()
    )]
    JointOutOfRange { what: &'static str, violation: LimitViolation },
    /// No configuration reaches the pose, even without joint limits; for an arm without a closed form: no configuration
    /// that was found within the joint limits reaches it.
    #[error(
        "the pose is out of reach: at ({:.3}, {:.3}, {:.3}) m the nearest reachable tcp pose is {:.4} m and {:.2}° \
         away{}",
        .target_m[0], .target_m[1], .target_m[2],
        .nearest.position_residual_m, .nearest.angle_residual_rad.to_degrees(),
        list_joints(.nearest_at_limit)
    )]
    OutOfReach {
        /// The requested tcp position, base frame, m.
        target_m: [f64; 3],
        /// The nearest pose that the arm reaches within its limits, with its error.
        nearest: Box<IkSolution>,
        /// Joints (1 to 7) that are at a limit in the nearest pose.
        nearest_at_limit: Vec<usize>,
    },
    /// Configurations reach the pose, but each of them violates a joint limit.
    #[error(
        "a joint limit forbids the pose: joint {} would have to be at {:.2} degrees, outside [{:.2}, {:.2}]; \
         within the limits, the nearest tcp pose is {:.4} m and {:.2}° away",
        .violation.joint, .violation.found_rad.to_degrees(), .violation.min_rad.to_degrees(), .violation.max_rad.to_degrees(),
        .nearest.position_residual_m, .nearest.angle_residual_rad.to_degrees()
    )]
    JointLimit {
        /// The violated limit of the configuration with the smallest violation.
        violation: LimitViolation,
        /// The nearest pose that the arm reaches within its limits, with its error.
        nearest: Box<IkSolution>,
    },
    /// A straight path reaches a joint limit.
    #[error(
        "the straight path reaches a joint limit after {:.1} %: joint {} would have to be at {:.2} degrees, outside [{:.2}, {:.2}]",
        .at_share * 100.0, .violation.joint, .violation.found_rad.to_degrees(), .violation.min_rad.to_degrees(),
        .violation.max_rad.to_degrees()
    )]
    PathJointLimit {
        /// Fraction of the path that was followed, 0 to 1.
        at_share: f64,
        violation: LimitViolation,
    },
    /// A straight path passes a singularity or leaves the reach of the arm.
    #[error(
        "the straight path cannot be followed beyond {:.1} %: {reason}", .at_share * 100.0
    )]
    PathBlocked {
        /// Fraction of the path that was followed, 0 to 1.
        at_share: f64,
        /// The reason why there is no solution.
        reason: &'static str,
    },
    /// No trajectory could be computed.
    #[error("no trajectory within the limits: {reason}")]
    Trajectory { reason: String },
}

fn list_joints(joints: &[usize]) -> String {
    if joints.is_empty() {
        return String::new();
    }
    let names: Vec<String> = joints.iter().map(usize::to_string).collect();
    format!(", with joint {} at its limit", names.join(", "))
}
