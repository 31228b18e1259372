//! One program for all tests of this folder: each links the whole crate.
#![allow(clippy::unwrap_used)]

mod sequence;
mod wire;
