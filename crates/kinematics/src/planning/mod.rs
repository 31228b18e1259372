//! Motions around obstacles.
//!
//! ```text
//! start ────────────────────────┐
//! goal poses ─> configurations ─┼─> RRT-Connect ─> shortcuts ─> round corners ─> Plan ─> trajectories
//! CollisionModel ─> Checker ────┘                                    approach ──┘
//! ```
//!
//! The planner has no clock: a search ends after a number of collision checks, so the plan is the same on every
//! machine.

mod corners;
mod error;
mod explanation;
mod goals;
mod line;
mod plan;
mod rrt;
mod shortcut;

pub use error::PlanError;
pub use explanation::{PlanPart, nearest_on, plan_parts};
pub use line::{CheckedLine, checked_line};
pub use plan::{Plan, PlanOptions, StraightApproach};
