//! The C library `libsdg`. Its functions, structures and documentation are in include/sdg.h, which `header` generates
//! from this crate.
//!
//! ```text
//! photo, marks ─ sdg_teach ──┐
//! path ─ sdg_model_load ─────┤
//! path ─ sdg_camera_load ────┴─ sdg_detect(picture, options) ─ sdg_detections_count, _get, _best, _polygon, _keypoints, _json
//!                               each gives a status; sdg_last_error has the text of the calling thread's last error
//! ```
//! Objects are numbers (`handles`), so the use of a freed object is an error and not an invalid pointer. No panic
//! leaves the library (`border`). Deliberately absent: reading pictures, tracking and evaluation, which the program and
//! the Python package provide.
#![cfg_attr(test, allow(clippy::unwrap_used))]
#![expect(non_camel_case_types, reason = "types have the names of the header")]

mod border;
mod convert;
mod functions;
mod handles;
#[cfg(test)]
mod header;
mod types;

pub use functions::*;
pub use types::*;
