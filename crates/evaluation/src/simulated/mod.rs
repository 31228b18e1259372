//! The paper's protocol: every model taught on every part, tried on unseen pictures and grasping, and its tables.
//!
//! ```text
//! Evaluation ─ units ─ Queue ─ workers (a share of the cores each) ─ Store: a file for every unit, as it ends
//!                                                                      │
//!                              Speed, alone on all cores ──────────────┤
//!                                                                      └─ Summary ─ tables: Markdown, JSON, page
//! ```
//!
//! A **network** is what is taught; models B and C are two readings of one. A **unit** is the least piece of work that is
//! kept or lost as a whole: one teaching, one attempt, the pictures of one part. A **cell** is one model on one part.
//! Random choices depend on the seed, the part and the attempt's number alone, so every model meets the same scenes and
//! `sdg rehearse` with a part's seed (1000 times the evaluation's, plus the part's place in the list) meets them again.
//!
//! [`sharing`] has the same units done by many processes, on a cluster's machines.
//!
//! What is in the store is not done again, so an evaluation that was interrupted goes on where it stopped. A teaching
//! that led to nothing is a result, too: all attempts of its cell count as failed.

mod attempting;
pub mod axes;
pub mod cameras;
mod cell;
mod files;
mod groups;
mod jitter;
mod looking;
mod one_unit;
mod page;
mod paper;
mod records;
mod schedule;
mod settings;
pub mod sharing;
mod store;
mod summary;
mod tables;
mod teaching;
mod units;
#[cfg(test)]
mod whole_runs;
mod work;

pub use cell::{Cell, Marks};
pub use files::WrittenTables;
pub use groups::PartGroup;
pub use page::page;
pub use records::{
    AttemptRecord, AttemptsRecord, DetectionRecord, LookRecord, PictureRecord, SpeedRecord, TeachingRecord,
};
pub use settings::{Settings, TeachingSettings};
pub use store::Store;
pub use summary::{CellSummary, ModelSummary, Summary};
pub use tables::{Titled, markdown, tables};
pub use units::Evaluation;
