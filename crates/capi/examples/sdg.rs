//! What is linked into libsdg.so: all of `sdg-capi`.

pub use sdg_capi::*;
