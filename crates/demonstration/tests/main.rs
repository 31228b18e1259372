//! One program for all tests of this folder: each links the whole crate.
#![allow(clippy::unwrap_used)]

mod formats;
mod outlines;
#[path = "outlines/shadows.rs"]
mod shadows;
#[path = "outlines/simulated_person.rs"]
mod simulated_person;
