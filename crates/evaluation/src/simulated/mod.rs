//! The paper's protocol: every model is taught on every part, tested on unseen pictures and in grasps; the results are
//! tables.
//!
//! ```text
//! Evaluation ─ units ─ Queue ─ workers (the cores divided among them) ─ Store: a file for every finished unit
//!                                                                         │
//!                              Speed, alone on all cores ─────────────────┤
//!                                                                         └─ Summary ─ tables: Markdown, JSON, page
//! ```
//!
//! A **network** is taught; models B and C use the same network. A **unit** is a piece of work for one worker: a
//! teaching run, a model's attempts on a part, the pictures of a part. A teaching run, an attempt, and a model's
//! results on the pictures of a part are stored completely or not at all. A **cell** is one model on one part. Random
//! choices depend only on the seed, the part and the number of the attempt or picture, so every model gets the same
//! scenes. `sdg rehearse` with a part's seed (1000 times the evaluation's, plus the part's index in the list) repeats
//! the attempts.
//!
//! In [`sharing`], many processes share the units, on the machines of a cluster.
//!
//! Units in the store are not done again, so that an interrupted evaluation can be continued. A teaching run that gave
//! no model is a result as well: all attempts of its cell count as failed.

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
