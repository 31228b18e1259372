//! Hostile input for every reader of strangers' files and messages.
//!
//! ```text
//! corpus (targets: seeds) ─ mutator, by number ─ one target ─ read, or refused with an error
//!                                                    └─ a panic, more time or more memory than promised: a failure, with its input
//! ```
//!
//! Each execution depends on the target's name and its number alone: a long run is resumed at any number, and a failure is made again
//! by one. `make hardening` runs them; a short run is part of the tests.
//!
//! Left out: guidance by coverage while it runs (`make hardening COVERAGE=1` counts which lines the executions reach).
//!
//! ```
//! let workcell = sdg_fuzz::TARGETS.iter().find(|target| target.name == "workcell").unwrap();
//! // Whatever the bytes are, the target returns.
//! assert!(!(workcell.run)(b"[table]\nheight_mm = \"high\""));
//! ```
// Forbidden but for targets/c_border.rs, which calls the C library.
#![deny(unsafe_code)]

mod mutator;
mod run;
mod target;
mod targets;

pub use mutator::{make_mistakes, mutated};
pub use run::{Failure, Outcome, execute, run};
pub use target::{MAX_BYTES_PER_INPUT_BYTE, MAX_SECONDS, Target};
pub use targets::{TARGETS, costliest_pickles};
