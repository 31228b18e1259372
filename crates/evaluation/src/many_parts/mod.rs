//! Many parts taught from a folder of demonstrations, each model tried on every other's photo, and one page of it.
//!
//! ```text
//! DemonstrationFolder ─ PartDemonstrations ─ teach ─ PartStore ─┬─ CrossCheck: each model on every other's photo
//!                                                               └─ findings: look alike, need another photo ─ page
//! OUT/models/NAME.sdg   OUT/parts/NAME.json   OUT/index.html
//! ```
//!
//! What was taught from the same files with the same arguments is not taught again, so that an interrupted run goes on, and
//! so that parts taught by other processes (`--part`) are taken.

mod cross_check;
mod findings;
mod folder;
mod page;
mod part_store;
mod teach;

pub use cross_check::CrossCheck;
pub use findings::Findings;
pub use folder::{DemonstrationFolder, PartDemonstrations};
pub use page::page;
pub use part_store::{PartOutcome, PartRecord, PartStore};
pub use teach::teach_part;
