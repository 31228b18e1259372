//! A close look at a pose: table where the part should be, missing or additional structure, and whether the mirror
//! image fits better.
//!
//! ```text
//! photo ───────────────────────────┐
//! picture, sampled at the pose ────┼─ 120×120 pixels, the part 96 long ─┬─ colours by cell, table's colours ─ bare
//! mirror image, where it fits best ┘                                    └─ gradients ─ fit, no_rim, added, mirrored
//! ```
//! [`crate::Structure`] measures agreement. This module measures contradiction: a hand that covers the part is no
//! contradiction, but table that is visible in the part's place is one.

mod close_up;
mod gradients;
mod look;
mod rival;
mod table;

pub(crate) use self::close_up::CloseUp;
pub use self::look::{CloseLook, RivalFit};
pub(crate) use self::rival::Rival;
pub use self::table::TableColors;
