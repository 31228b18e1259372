//! A split of test sets into those that constants may be fitted on and those that are only reported, both measured alike.
//!
//! ```text
//! split file ─ SplitSet ─ ReadySet: demonstration, truth ─ teach, detect ─ SetRun ─ Measured: of one model, all seeds
//!                                                                                      │
//!                                                    tables, JSON, a line a candidate ─┘
//! ```
//!
//! A **side** is one of tuned, used and reported. **Wrong** is a detection on a picture with the part that hits nothing, out of all
//! that are accepted there; a **false alarm** is a picture without the part on which anything is accepted.

mod candidates;
mod counts;
mod file;
mod run;
mod summary;
mod tables;

pub use candidates::candidates;
pub use file::{Side, SplitSet, read_split};
pub use run::{Measured, ReadySet};
pub use summary::summary;
pub use tables::tables;
