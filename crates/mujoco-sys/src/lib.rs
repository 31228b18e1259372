//! Raw bindings to MuJoCo 2.2.2, the version that Debian 12 ships as `libmujoco-dev`.
//!
//! ```text
//! /usr/include/mujoco/*.h ── bindgen (ahead of time) ──> src/bindings.rs ──┐
//! libmujoco.so ── build.rs ───────────────────────────────────────────────┴─> sdg-simulation
//! ```
//!
//! The bindings were generated from the Debian headers and are committed, so that a build needs no
//! libclang. Feature `buildtime_bindgen` generates them afresh from the headers that are installed,
//! for another version of MuJoCo. Since a library of another version would read our structs at the
//! wrong places, [`check_library`] compares the version and the struct sizes once at start; the
//! tests compare every size and many offsets with what a C compiler says.
//!
//! Left out: everything safe (that is `sdg-simulation`), MuJoCo's small vector library, its user
//! interface and its printing functions.
//!
//! ```
//! sdg_mujoco_sys::check_library().expect("libmujoco is 2.2.2");
//! // SAFETY: `mj_version` reads a constant.
//! assert_eq!(unsafe { sdg_mujoco_sys::mj_version() }, 222);
//! ```

#[cfg(not(feature = "buildtime_bindgen"))]
#[rustfmt::skip]
#[allow(missing_docs, non_camel_case_types, non_snake_case, non_upper_case_globals, clippy::all)]
mod bindings;

#[cfg(feature = "buildtime_bindgen")]
#[allow(missing_docs, non_camel_case_types, non_snake_case, non_upper_case_globals, clippy::all)]
mod bindings {
    include!(concat!(env!("OUT_DIR"), "/bindings.rs"));
}

mod check;

pub use bindings::*;
pub use check::{LibraryMismatch, check_library};
