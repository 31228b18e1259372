//! Collisions of the arm with itself and with the obstacles around it.
//!
//! ```text
//! capsules of every body ─┐
//! obstacles, held part ───┼─> CollisionModel ─┬─> Checker: many configurations, whole motions
//! pairs that may touch ───┘                   └─> nearest: names, distance, gradient
//! ```
//!
//! Capsules contain the visible shapes of the arm: if the capsules do not touch, these shapes do not touch either.
//! Tests in crates/simulation check this, and compare the collisions with MuJoCo's.

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
