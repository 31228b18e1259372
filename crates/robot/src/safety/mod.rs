//! Limits that every motion is checked against before it begins.
//!
//! ```text
//! Trajectory ── SafetyLimits::check ──► CheckedMotion ── Arm::follow
//!                     └─ Violation: which limit, when, by how much; nothing moves
//! ```
//! The whole motion is looked at before it begins, at every millisecond: joint limits, the tcp's limits, the workspace, the table,
//! the arm against itself. These limits are no safety function in the sense of a standard: they know nothing of people, of what
//! stands in the cell, or of a fault below them. An emergency stop remains required.

mod leaving;
mod limits;
mod self_collision;
mod violation;

pub(crate) use leaving::{FeltBelow, LimitsFrom};
pub use limits::{CheckedMotion, SafetyLimits, WorkspaceBox};
pub use self_collision::SelfCollision;
pub use violation::Violation;
