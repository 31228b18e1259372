//! The reason why there is no plan: the link, the obstacle, the limit.

use crate::collision::Proximity;
use crate::error::KinematicsError;

/// Errors of planning.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PlanError {
    /// An invalid input, a start beyond the joints' ranges, or a goal that no configuration reaches.
    #[error("{what}: {cause}")]
    Kinematics {
        /// Which input.
        what: String,
        /// Its error.
        cause: KinematicsError,
    },
    /// No goal was given.
    #[error("expected at least one goal pose, found none")]
    NoGoal,
    /// An option is outside its range.
    #[error("{option} must be {expected}, found {found}")]
    InvalidOption {
        /// Which option.
        option: &'static str,
        /// The accepted values.
        expected: &'static str,
        /// The given value.
        found: f64,
    },
    /// An obstacle overlaps the fixed part of the arm's first link.
    #[error(
        "the obstacle \"{obstacle}\" encloses the robot: it overlaps the arm's column by {:.0} mm, which no motion changes",
        .depth_m * 1e3
    )]
    EnclosesRobot {
        /// Its name.
        obstacle: String,
        /// The depth of the overlap, m.
        depth_m: f64,
    },
    /// The start is in collision, or closer to something than the margin.
    #[error("the start is not free: {nearest}; at least {:.1} mm are required", .margin_m * 1e3)]
    StartBlocked {
        /// The body that is too close.
        nearest: Proximity,
        /// The required distance, m.
        margin_m: f64,
    },
    /// Every configuration that reaches the goal is in collision, or closer to something than the margin.
    #[error(
        "the goal is not free: {num_configurations} configurations reach it, and in the best of them {nearest}; at \
         least {:.1} mm are required",
        .margin_m * 1e3
    )]
    GoalBlocked {
        /// Number of tried configurations within the joints' ranges.
        num_configurations: usize,
        /// The body that is too close to the best of them.
        nearest: Proximity,
        /// The required distance, m.
        margin_m: f64,
    },
    /// The straight approach ends early from every configuration that reaches its start.
    #[error("at most {:.0} % of the approach can be followed: {why}", .share * 100.0)]
    ApproachBlocked {
        /// The largest free share of the approach, 0 to 1.
        share: f64,
        /// The reason for its end there.
        why: String,
    },
    /// The search ended without a path.
    #[error("no path found in {num_checks} collision checks; the search was stopped most often by: {}", list(.blockers))]
    NotFound {
        /// Number of checked configurations.
        num_checks: usize,
        /// Pairs that blocked motions, the most frequent first, each with its share.
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
