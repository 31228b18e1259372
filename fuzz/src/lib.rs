//! Hostile input for the readers of files and messages from outside.
//!
//! ```text
//! corpus (targets: seeds) ─ mutator, by number ─ one target ─ accepted, or rejected with an error
//!                                                    └─ a panic, or too much time or memory: a failure, kept with its input
//! ```
//!
//! Each execution depends only on the target's name and its own number, so a long run is resumed at any number, and a
//! failure is reproduced by its number. `make hardening` runs the targets; a short run is part of the tests.
//!
//! Left out: guidance by coverage during the run (`make hardening COVERAGE=1` reports the lines that the executions
//! reach).
//!
//! ```
//! let workcell = sdg_fuzz::TARGETS.iter().find(|target| target.name == "workcell").unwrap();
//! // The target returns for all bytes.
//! assert!(!(workcell.run)(b"[table]\nheight_mm = \"high\""));
//! ```
// Not `forbid`, because targets/c_border.rs calls the C library.
#![deny(unsafe_code)]

mod mutator;
mod run;
mod target;
mod targets;

pub use mutator::{make_mistakes, mutated};
pub use run::{Failure, Outcome, execute, run};
pub use target::{MAX_BYTES_PER_INPUT_BYTE, MAX_SECONDS, Target};
pub use targets::{TARGETS, costliest_pickles};
