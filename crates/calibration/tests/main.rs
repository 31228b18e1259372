//! One program for all tests of this folder, because each program links the whole crate.
#![allow(clippy::unwrap_used)]

mod detection;
mod hand_eye;
mod hand_eye_mistakes;
mod intrinsics;
mod rendering;
mod table;
mod textures;
