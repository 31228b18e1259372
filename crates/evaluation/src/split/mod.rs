//! A split of test sets into sets on which constants may be fitted and sets that are only reported. All are measured in
//! the same way.
//!
//! ```text
//! split file ─ SplitSet ─ ReadySet: demonstration, ground truth ─ teach, detect ─ SetRun ─ Measured: one model, all seeds
//!                                                                                             │
//!                                                       tables, JSON, one line per detection ─┘
//! ```
//!
//! A **side** is one of tuned, used and reported. **Wrong** is the fraction of detections without a hit among all
//! accepted in pictures with the part. A **false alarm** is a picture without the part in which a detection is
//! accepted.

mod candidates;
mod counts;
mod file;
mod measuring;
mod run;
mod summary;
mod tables;

pub use candidates::candidates;
pub use file::{Side, SplitSet, read_split};
pub use measuring::{measure, results_json, sides_of};
pub use run::{Measured, ReadySet};
pub use summary::summary;
pub use tables::tables;
