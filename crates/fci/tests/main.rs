//! One program for all tests of this folder, because every program links the whole crate.
#![allow(clippy::unwrap_used)]

mod sequence;
mod wire;
