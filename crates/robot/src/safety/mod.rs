//! The limits against which every motion is checked before it starts.
//!
//! ```text
//! Trajectory ── SafetyLimits::check ──► CheckedMotion ── Arm::follow
//!                     └─ Violation: the limit, the time and the value; nothing moves
//! ```
//! The whole motion is checked before it starts, at every millisecond: joint limits, the tcp's limits, the workspace,
//! the distance from the table, and the distances between the arm's bodies. These limits are not a safety function in
//! the sense of a standard: they do not cover people, obstacles in the cell, or faults of lower layers. An emergency
//! stop remains required.

mod leaving;
mod limits;
mod self_collision;
mod violation;

pub(crate) use leaving::{FeltBelow, LimitsFrom};
pub use limits::{CheckedMotion, SafetyLimits, WorkspaceBox};
pub use self_collision::SelfCollision;
pub use violation::Violation;
