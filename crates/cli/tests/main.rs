//! One program for all tests of this folder: each links the whole crate.
#![allow(clippy::unwrap_used)]

mod annotation;
mod bad_input;
mod base_weights;
mod batch;
mod browser;
mod calibration;
#[cfg(feature = "simulation")]
mod camera;
mod devices;
#[cfg(feature = "simulation")]
mod evaluation;
mod half_precision;
mod labelled_pictures;
#[cfg(feature = "simulation")]
mod live_detection;
mod live_pictures;
mod many_parts;
#[cfg(feature = "simulation")]
mod own_part;
mod place;
#[cfg(feature = "simulation")]
mod plan;
#[path = "../../calibration/tests/rendering/mod.rs"]
mod rendering;
#[cfg(feature = "simulation")]
mod robot;
#[cfg(unix)]
mod robot_stops;
#[cfg(feature = "simulation")]
mod shared_units;
mod shell;
mod simulated_arm;
mod support;
mod walk;
mod weights;
