//! Links all of `sdg-capi` into libsdg.so.

pub use sdg_capi::*;
