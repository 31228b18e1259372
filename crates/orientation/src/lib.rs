//! The orientation CNN of grasp model A: estimates the angle of a part from the crop of its detected box.
//!
//! ```text
//! RgbImage, BoundingBox ─ CropWindow: a square around the box's centre ─ crop, S×S
//!   ─ OrientationCnn: convolutional stages, two fully connected layers ─ 360 logits
//!   ─ AngleClasses: the peak, and the circular mean around it ─ AngleReading {angle, confidence}
//! ```
//!
//! The angle is the direction of the marked grasp line, `atan2(dy, dx)` in pixels with y down, so several
//! demonstrations of one part agree on it, whatever the part's rotation in each photo.
//!
//! Elsewhere: finding the box (crate `detection`), training (crate `training`), files and clocks. Parts that look the
//! same at every angle are excluded, because there is nothing to learn.
//!
//! # Example
//! ```
//! use burn::tensor::Device;
//! use image::RgbImage;
//! use sdg_geometry::BoundingBox;
//! use sdg_orientation::{OrientationConfig, crop_for};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let network = OrientationConfig::edge().init(&Device::flex(), 7)?;
//! let detected = BoundingBox::new(200.0, 150.0, 330.0, 260.0)?;
//! let crop = crop_for(&RgbImage::new(640, 480), &detected, network.config().input_px)?;
//! let reading = network.predict(&crop)?;
//! assert!(reading.angle.degrees().abs() <= 180.0);
//! # Ok(())
//! # }
//! ```
#![forbid(unsafe_code)]
#![cfg_attr(test, allow(clippy::unwrap_used))]

mod angle_classes;
mod box_crop;
mod config;
mod error;
mod network;

pub use angle_classes::{AngleClasses, AngleReading, Labels};
pub use box_crop::crop_for;
pub use config::{OrientationConfig, Readout};
pub use error::{OrientationError, Result, check_setting};
pub use network::{OrientationCnn, crop_batch};
pub use sdg_layers::state_dict::{ImportReport, StateDict, WeightTensor};
