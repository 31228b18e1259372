//! The native part of the Python package `sdg`; its public interface is written in Python, in `sdg/`.
//!
//! ```text
//! sdg/__init__.py ─ arrays, paths, numbers ─ here ─ sdg-bindings
//!                 ─ records as JSON text ──────────┘
//! ```
//! Arrays are copied while the GIL is held; it is released for everything that takes time. Without its feature
//! `extension` the crate is empty, so that a build of the workspace does not compile PyO3.
#![cfg_attr(not(feature = "extension"), forbid(unsafe_code))]

#[cfg(feature = "extension")]
mod array;
#[cfg(feature = "extension")]
mod errors;
#[cfg(feature = "extension")]
mod native;
