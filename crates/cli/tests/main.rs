//! One test binary for all files of this folder, because each binary links the whole crate.
#![allow(clippy::unwrap_used)]

mod annotation;
mod bad_input;
mod base_weights;
mod batch;
mod browser;
mod calibration;
mod camera;
mod devices;
mod gallery;
#[cfg(unix)]
mod guides;
mod half_precision;
mod kept_models;
mod labelled_pictures;
mod live_detection;
mod live_pictures;
mod many_parts;
mod marks_check;
mod outputs;
mod own_part;
mod picture_kinds;
mod place;
mod plan;
mod reference;
mod region;
#[path = "../../calibration/tests/rendering/mod.rs"]
mod rendering;
mod robot;
#[cfg(unix)]
mod robot_stops;
mod shared_units;
mod shell;
mod simulated_arm;
mod split;
#[cfg(target_os = "linux")]
mod streams;
mod support;
mod variants;
mod walk;
mod weights;
