//! Axes along which the paper's protocol is made more difficult, one at a time, and grasps under errors.
//!
//! ```text
//! AxesEvaluation ─ units: teaching runs (as in the protocol, and from jittered marks), pictures of a part and axis, attempts
//!       │                                    │
//!       │              each picture rendered once, searched by every model, with the check and by the network alone
//!       └─ Store ─ AxesSummary (the paper's parts and the held-out ones separately) ─ Markdown, JSON, page
//! ```
//!
//! A **case** is an instance of the part in a picture, or a look-alike: the unit for comparing two models. A
//! **condition** is the error in an attempt. Pictures depend only on part, axis, number and seed; attempts have the
//! scenes of the paper's protocol.

mod against;
mod files;
mod known_from_simulator;
mod lines;
mod matching;
mod page;
mod paired;
mod records;
mod selection;
mod settings;
mod summary;
mod tables;
mod units;
mod way;
mod work;

pub use against::{ALL_WITH_PART, Against, RunDifference, difference_tables};
pub use lines::{difference_lines, summary_lines};
pub(super) use matching::{TOLERANCE, match_one_to_one};
pub use page::page;
pub use paired::PairedCounts;
pub use records::{Answer, AxisPicture, AxisRecord, Case, LookAlike, PlacedDetection};
pub use selection::{GraspCondition, Selection};
pub(super) use settings::has_complete_rounds;
pub use settings::{AttemptSettings, AxisSettings};
pub(super) use summary::instances_in_picture;
pub use summary::{
    AxesSummary, AxisFigures, GraspFigures, GroupSummary, LookAlikeFigures, PartShare, Seconds, Third, lowest,
};
pub use tables::{markdown, tables};
pub use units::{AxesEvaluation, GRASPING_MODELS};
pub use way::Way;
pub use work::RunEnd;
pub(super) use work::draw;
