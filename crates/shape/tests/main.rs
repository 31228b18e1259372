//! One program for all tests of this folder, because each program links the whole crate.
#![allow(clippy::unwrap_used)]

mod comparison;
mod refinement;
mod scenes;
mod search;
