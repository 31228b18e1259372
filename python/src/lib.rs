//! The native part of the Python package `sdg`; what users see of it stands in `sdg/`, in Python.
//!
//! ```text
//! sdg/__init__.py ─ arrays, paths, numbers ─ here ─ sdg-bindings
//!                 ─ records as JSON text ──────────┘
//! ```
//! Arrays are copied while Python's lock is held, which is released for everything that takes time. Without its feature `extension` the crate
//! is empty, so that no build of the workspace compiles PyO3.
#![cfg_attr(not(feature = "extension"), forbid(unsafe_code))]

#[cfg(feature = "extension")]
mod array;
#[cfg(feature = "extension")]
mod errors;
#[cfg(feature = "extension")]
mod native;
