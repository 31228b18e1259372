//! Evaluation of models: on labelled pictures, in the simulator, and on held-out samples; results as tables, pages and
//! JSON.
//!
//! ```text
//! LabelledFolder ─ Tested ─ judge ─ Totals                 the user's own pictures            labelled_pictures
//! TaughtFile ─ HeldBackFigures                             samples not used in teaching       held_back
//! SplitSet ─ ReadySet ─ Measured                           sets to tune on, sets to report    split
//! DemonstrationFolder ─ CrossCheck ─ Findings              many parts, for look-alikes        many_parts
//! feature simulation:
//! Rehearsal ─ attempts of a simulated arm, with the finder of a real one                       rehearsal
//! Evaluation, AxesEvaluation, CamerasEvaluation ─ units ─ Store ─ Summary ─ tables, page       simulated
//! ```
//!
//! Not in this crate: arguments, terminals and exit codes. Progress is reported to a [`Progress`]. An error that an
//! option corrects is an [`EvaluationError`], to which the caller adds the option.
//!
//! ```
//! use sdg_evaluation::{Share, wilson_interval};
//!
//! let [low, high] = wilson_interval(Share { count: 80, of: 80 });
//! assert!(low > 0.95 && high > 0.999);
//! ```
#![forbid(unsafe_code)]
#![allow(missing_docs, reason = "records and figures: their fields are named for what they are")]
#![cfg_attr(test, allow(clippy::unwrap_used))]

#[cfg(feature = "simulation")]
mod against_truth;
mod error;
mod footer;
pub mod held_back;
pub mod labelled_pictures;
mod machine;
pub mod many_parts;
#[cfg(feature = "simulation")]
mod motion_drawing;
#[cfg(feature = "simulation")]
mod own_part;
mod progress;
#[cfg(feature = "simulation")]
pub mod rehearsal;
#[cfg(feature = "simulation")]
pub mod run_page;
#[cfg(feature = "simulation")]
mod run_words;
mod shell_word;
#[cfg(feature = "simulation")]
pub mod shipped;
#[cfg(feature = "simulation")]
mod simulated;
#[cfg(feature = "simulation")]
mod simulated_pictures;
pub mod split;
mod statistics;
mod taught_file;
pub mod taught_words;
pub mod teaching_page;
#[cfg(feature = "simulation")]
pub mod trial;

pub use error::EvaluationError;
pub use machine::machine;
#[cfg(feature = "simulation")]
pub use motion_drawing::{draw_dry_run, draw_motions};
#[cfg(feature = "simulation")]
pub use own_part::{Assumption, OwnPart, OwnPartError, OwnPartSizes};
pub use progress::{NoProgress, Progress};
#[cfg(feature = "simulation")]
pub use run_words::{attempt_in_words, run_json};
pub use shell_word::quoted;
#[cfg(feature = "simulation")]
pub use simulated::*;
#[cfg(feature = "simulation")]
pub use simulated_pictures::SimulatedPictures;
pub use statistics::{Share, newcombe_interval, wilson_interval};
pub use taught_file::TaughtFile;
