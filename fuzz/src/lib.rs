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
//! Left out: guidance by coverage; sockets, on which `sdg-fci`'s and `sdg-camera`'s own tests play hostile robots and cameras.
//!
//! ```
//! let workcell = sdg_fuzz::TARGETS.iter().find(|target| target.name == "workcell").unwrap();
//! // Whatever the bytes are, the target returns.
//! assert!(!(workcell.run)(b"[table]\nheight_mm = \"high\""));
//! ```
#![forbid(unsafe_code)]

mod mutator;
mod run;
mod target;
mod targets;

pub use mutator::mutated;
pub use run::{Failure, Outcome, run};
pub use target::{MAX_SECONDS, Target};
pub use targets::TARGETS;
