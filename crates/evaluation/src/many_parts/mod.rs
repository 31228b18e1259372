//! Many parts that are taught from a folder of demonstrations; each model is run on every part's photo. The results
//! are one page.
//!
//! ```text
//! DemonstrationFolder ─ PartDemonstrations ─ PartTeaching ─ PartStore ─┬─ CrossCheck: each model on every part's photo
//!                                                                      └─ findings: parts that look alike or need another photo ─ page
//! OUT/models/NAME.sdg   OUT/parts/NAME.json   OUT/index.html
//! ```
//!
//! Parts that were already taught from the same files with the same arguments are not taught again: an interrupted run
//! can be continued, and parts taught by other processes (`--part`) are used.

mod cross_check;
mod findings;
mod folder;
mod page;
mod part_store;
mod teach;
mod teaching;

pub use cross_check::CrossCheck;
pub use findings::Findings;
pub use folder::{DemonstrationFolder, PartDemonstrations};
pub use page::page;
pub use part_store::{PartOutcome, PartRecord, PartStore};
pub use teach::teach_part;
pub use teaching::{PartOutcomes, PartTeaching};
