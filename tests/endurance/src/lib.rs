//! Endurance tests of `make endure`, on Linux for x86-64 only.
//!
//! - [`crash`]: commands killed at random moments under [`tracer`]; [`disk`] loses unsynced data. A later call resumes
//!   the run. With a [`flakey`] device, in a virtual machine, Linux itself loses the data.
//! - [`refusals`]: the same commands on a full or read-only disk, without free descriptors, or while the clock is set
//!   back.
//! - [`soak`]: long runs of live detection, of the page, and of a camera that disconnects.
//!
//! It runs the program `sdg` from outside, as a user does, and uses only its crates `calibration` and `geometry`, to
//! render the board.
#![cfg(all(target_os = "linux", target_arch = "x86_64"))]

pub mod boards;
pub mod crash;
pub mod disk;
pub mod files;
pub mod flakey;
pub mod page;
pub mod refusals;
pub mod scenario;
pub mod soak;
pub mod tracer;

#[path = "../../../crates/calibration/tests/rendering/mod.rs"]
#[allow(missing_docs, clippy::unwrap_used, reason = "a file of tests")]
mod rendering;
