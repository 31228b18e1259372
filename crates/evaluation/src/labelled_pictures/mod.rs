//! Tests a taught model on the user's own labelled pictures: found, missed, wrong, false alarms and errors.
//!
//! ```text
//! DIR ─ LabelledFolder: pictures, their instances, what is left out ─┐
//! GraspModel ─ detect, picture by picture ───────────────────────────┴─ Tested ─ judge(min_score) ─ Judged ─ Totals
//!                                                                        │                             │
//!                                                                        └──────────── page, JSON ─────┘
//! ```
//!
//! A **part** is an instance that must be found. An **optional** instance (mostly covered, or seen from another side)
//! counts neither as missed nor, if hit, as wrong. A **hit** is a detection within 4 % of the instance's diagonal and
//! 10° of its marks, or, if it has no marks, with an IoU of at least 0.5; an instance has at most one hit. Instances
//! that the model was taught from are optional. A picture with such an instance is left out if all its instances are
//! optional.

mod folder;
mod label_offset;
mod page;
mod picture;
mod records;
mod score;
mod summary;
mod taught;
mod testing;
mod truth_file;

pub use folder::LabelledFolder;
pub use label_offset::{LabelOffset, label_offset};
pub use page::{in_words, page};
pub use picture::{Instance, LabelledPicture, LeftOut};
pub use records::{Evaluated, by_kind_json, by_min_score, to_json};
pub use score::{Errors, HitError, Judged, Tested, Totals, Truth, by_kind, judge};
pub use sdg_cell::DEFAULT_MIN_SCORE;
pub use summary::summary;
pub use testing::TestedFolder;
pub use truth_file::{TRUTH_FILE, TruthEntry};
