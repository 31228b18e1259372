//! Common code of the Python package and the C library: a taught model with a camera, trackers, teaching and
//! evaluation. Every error has a kind and a text.
//!
//! ```text
//! file ─ Model::read ─┐
//! file ─ Camera::read ┴─ Model::detect(picture, View) ─ Detections: the records of `sdg detect --json`
//! photo, marks ─ teach ─ Model         Tracker::frame(picture, time) ─ tracked parts         evaluate(folder) ─ figures
//! ```
//! Deliberately absent: objects of other languages, pointers, command-line options.
//!
//! ```no_run
//! use std::path::Path;
//!
//! use sdg_bindings::{DEFAULT_MIN_SCORE, Model, View, read_picture};
//!
//! # fn main() -> Result<(), sdg_bindings::Fault> {
//! let model = Model::read(Path::new("part.sdg"))?;
//! let picture = read_picture(Path::new("table.png"), None)?;
//! let found = model.detect(&picture, &View::default(), DEFAULT_MIN_SCORE)?;
//! println!("{}", found.to_json());
//! # Ok(())
//! # }
//! ```
#![forbid(unsafe_code)]
#![cfg_attr(test, allow(clippy::unwrap_used))]

mod camera;
mod evaluation;
mod fault;
mod model;
mod picture;
mod teaching;
mod threads;
mod tracker;

pub use camera::Camera;
pub use evaluation::evaluate;
pub use fault::{Fault, FaultKind, Result};
pub use image::RgbImage;
pub use model::{Detections, Model, Record, RegionChoice, View};
pub use picture::{PixelOrder, PixelShape, read_picture};
pub use sdg_calibration::Frame;
pub use sdg_cell::{DEFAULT_MIN_SCORE, FoundRecord, PoseRecord};
pub use sdg_geometry::RotationalSymmetry;
pub use sdg_grasp::{AcceptedNegative, Contributions, DetectionRecord, GraspRecord, TeachOptions, TurnSource};
pub use teaching::{CameraTeaching, Teaching, teach};
pub use threads::on_threads;
pub use tracker::Tracker;
