//! Raw bindings to MuJoCo 2.2.2, the version that Debian 12 ships as `libmujoco-dev`.
//!
//! ```text
//! /usr/include/mujoco/*.h ── bindgen (ahead of time) ──> src/bindings.rs ──┐
//! libmujoco.so.2.2.2 ── loaded on the first request (library.rs) ──────────┴─> sdg-simulation
//! ```
//!
//! The bindings were generated from the Debian headers and are committed, so that a build needs no libclang. Feature
//! `buildtime_bindgen` generates them again from the installed headers, for another version of MuJoCo. A library of
//! another version would read the structs of these bindings at wrong offsets. [`load`] therefore compares the version
//! and the sizes of the structs that it can check. The tests compare the sizes and many offsets of the structs that
//! `sdg-simulation` uses with the values of a C compiler.
//!
//! A build needs no libmujoco, and a program starts without it. The functions that `sdg-simulation` calls are in
//! library.rs; the other functions declared by the bindings are not linked.
//!
//! Not included: safe wrappers (crate `sdg-simulation`), MuJoCo's small vector library and its user interface.
//!
//! ```
//! sdg_mujoco_sys::load().expect("libmujoco is 2.2.2");
//! // SAFETY: `mj_version` reads a constant.
//! assert_eq!(unsafe { sdg_mujoco_sys::mj_version() }, 222);
//! ```

#![cfg_attr(test, allow(clippy::unwrap_used))]

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
mod error;
// MuJoCo's names.
#[allow(non_snake_case)]
mod library;

pub use bindings::*;
pub use check::load;
pub use error::LibraryError;
// These explicit names take precedence over the declarations of the same names in `bindings::*`.
pub use library::{
    Handler, mj_collision, mj_contactForce, mj_defaultOption, mj_defaultVFS, mj_defaultVisual, mj_deleteData,
    mj_deleteModel, mj_deleteVFS, mj_forward, mj_fullM, mj_id2name, mj_kinematics, mj_loadXML, mj_makeData,
    mj_makeEmptyFileVFS, mj_name2id, mj_resetData, mj_step, mj_step1, mj_step2, mj_version, mjr_defaultContext,
    mjr_freeContext, mjr_makeContext, mjr_readPixels, mjr_render, mjr_setBuffer, mju_error, mjv_defaultCamera,
    mjv_defaultOption, mjv_defaultPerturb, mjv_defaultScene, mjv_freeScene, mjv_makeScene, mjv_updateScene,
    set_handlers,
};
