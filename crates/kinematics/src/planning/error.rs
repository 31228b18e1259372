//! The error type of planning, which names the cause: the link, the obstacle, the limit.

use crate::collision::Proximity;
use crate::error::KinematicsError;

/// Errors of planning.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PlanError {
    /// An input is invalid, the start is outside the joints' ranges, or no configuration reaches a goal.
    #[error("{what}: {cause}")]
    Kinematics {
        /// The input.
        what: String,
        /// The error of the input.
        cause: KinematicsError,
    },
    /// No goal was given.
    #[error("expected at least one goal pose, found none")]
    NoGoal,
    /// An option is outside its range.
    #[error("{option} must be {expected}, found {found}")]
    InvalidOption {
        /// The option.
        option: &'static str,
        /// The expected values.
        expected: &'static str,
        /// The value found.
        found: f64,
    },
    /// An obstacle overlaps the fixed part of the arm's first link.
    #[error(
        "the obstacle \"{obstacle}\" encloses the robot: it overlaps the arm's column by {:.0} mm, which no motion changes",
        .depth_m * 1e3
    )]
    EnclosesRobot {
        /// The name of the obstacle.
        obstacle: String,
        /// The depth of the overlap, m.
        depth_m: f64,
    },
    /// The start is in collision, or closer to a body than the margin.
    #[error("the start is not free: {nearest}; at least {:.1} mm are required", .margin_m * 1e3)]
    StartBlocked {
        /// The body that is too close.
        nearest: Proximity,
        /// The required distance, m.
        margin_m: f64,
    },
    /// All configurations that reach the goal are in collision, or closer to a body than the margin.
    #[error(
        "the goal is not free: {num_configurations} configurations reach it, and in the best of them {nearest}; at \
         least {:.1} mm are required",
        .margin_m * 1e3
    )]
    GoalBlocked {
        /// Number of configurations that were tried, within the joints' ranges.
        num_configurations: usize,
        /// The body that is too close in the best of these configurations.
        nearest: Proximity,
        /// The required distance, m.
        margin_m: f64,
    },
    /// The straight approach is blocked from every configuration that reaches its start.
    #[error("at most {:.0} % of the approach can be followed: {why}", .share * 100.0)]
    ApproachBlocked {
        /// The largest free fraction of the approach, 0 to 1.
        share: f64,
        /// The reason why the approach is blocked there.
        why: String,
    },
    /// The search ended without a path.
    #[error("no path found in {num_checks} collision checks; the search was stopped most often by: {}", list(.blockers))]
    NotFound {
        /// Number of checked configurations.
        num_checks: usize,
        /// Pairs that blocked motions, the most frequent first, each with its fraction.
        blockers: Vec<(String, f64)>,
    },
}

fn list(blockers: &[(String, f64)]) -> String {
    if blockers.is_empty() {
        return "nothing".to_owned();
    }
    let each = blockers.iter().map(|(pair, share)| format!("{pair} ({:.0} %)", share * 100.0));
    each.collect::<Vec<_>>().join(", ")
}
