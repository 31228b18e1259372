//! What the arm can touch: itself, and the obstacles around it.
//!
//! ```text
//! capsules of every body ─┐
//! obstacles, held part ───┼─> CollisionModel ─┬─> Checker: many configurations, whole motions
//! pairs that may touch ───┘                   └─> nearest: names, distance, gradient
//! ```
//!
//! Capsules hold the real shapes with some room, so arms whose capsules are apart are apart. crates/simulation compares them with MuJoCo.

mod arm_shape;
mod checker;
mod error;
mod lanes;
mod model;
mod pair_search;
mod shape;

pub use crate::capsule::Capsule;
pub use arm_shape::Body;
pub use checker::Checker;
pub use error::CollisionError;
pub use lanes::NUM_LANES;
pub use model::{CollisionModel, Obstacle, Proximity};
pub use shape::Shape;
