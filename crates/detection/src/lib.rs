//! The R-CNN family: one detector of boxes, keypoints and masks, driven by its configuration.
//!
//! ```text
//! RgbImage ─ ImageTransform ─ batch [N, 3, H, W]
//!   ─ ResNet ─ res2…res5 ─ Fpn ─ p2…p6
//!   ─ RegionProposalNetwork ─ proposals
//!   ─ RoiHeads: box head ─ detections ─ keypoint head ─ keypoints
//!                                     └ mask head ─ masks
//!   ─ Detections in pixels of the original image
//! ```
//!
//! The settings in which Detectron2 and torchvision differ are values of [`RcnnConfig`]; the [`presets`] set them. The
//! network runs on the device; anchors, matching, sampling, decoding and NMS run on the host in plain Rust, because
//! they are small. Everything random takes a seed.
//!
//! Not in this crate: files, threads and clocks; the optimiser and its schedule (crate `training`); image augmentation
//! (crate `demonstration`).
//!
//! # Example
//! ```
//! use burn::tensor::Device;
//! use image::RgbImage;
//! use sdg_detection::presets;
//!
//! # fn main() -> Result<(), sdg_detection::DetectionError> {
//! let detector = presets::edge(12).init(&Device::flex(), 7)?;
//! let image = detector.image_transform().apply(&RgbImage::new(640, 480))?;
//! let detections = detector.detect(&[image]);
//! assert_eq!(detections.len(), 1);
//! # Ok(())
//! # }
//! ```
#![forbid(unsafe_code)]
#![cfg_attr(test, allow(clippy::unwrap_used))]

pub mod anchors;
pub mod box_coder;
pub mod boxes;
pub mod config;
mod config_check;
mod config_file;
mod error;
pub mod fpn;
mod generalized_rcnn;
#[cfg(feature = "training")]
pub mod golden;
mod host;
pub mod image_transform;
pub mod imprint;
pub mod losses;
pub mod matcher;
pub mod presets;
mod resample;
pub mod resnet;
pub mod roi_heads;
pub mod roi_pooler;
pub mod rpn;
pub mod sampler;
mod target;

pub use config::RcnnConfig;
pub use error::{DetectionError, Result};
pub use generalized_rcnn::{Backbone, Detections, GeneralizedRcnn, ScoredKeypoint};
pub use image_transform::{ImageTransform, TransformedImage};
pub use losses::Losses;
pub use sdg_kernels::keep_freed_memory;
pub use target::{ObjectMask, ResizedTarget, Target};
