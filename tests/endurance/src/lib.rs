//! Endurance: what `make endure` runs, each part resumable, on Linux for x86-64 alone.
//!
//! - [`crash`]: commands killed at seeded moments under [`tracer`], with [`disk`] losing what was not synced.
//! - [`refusals`]: the same commands on a disk that is full or read-only, without descriptors, while the clock is set back.
//! - [`soak`]: long runs of live detection, of the page, and of a camera that goes away.
//!
//! It drives the program `sdg` from outside, as a user, and knows none of its crates but `calibration`, whose board it draws.
#![cfg(all(target_os = "linux", target_arch = "x86_64"))]

pub mod boards;
pub mod crash;
pub mod disk;
pub mod files;
pub mod page;
pub mod refusals;
pub mod scenario;
pub mod soak;
pub mod tracer;

#[path = "../../../crates/calibration/tests/rendering/mod.rs"]
#[allow(missing_docs, clippy::unwrap_used, reason = "a file of tests")]
mod rendering;
