//! One program for all tests of this folder: each links the whole crate.
#![allow(clippy::unwrap_used)]

mod edge_cases;
mod invariance;
mod opencv_golden;
mod rotation;
mod support;
