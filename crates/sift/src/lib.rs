//! SIFT: keypoints invariant to rotation, scale and light, their descriptors, matching, and the rotation of a part
//! relative to its demonstration.
//!
//! ```text
//! image ─► scale space ─► extrema of differences ─► directions ─► descriptors = Features
//!                                                                     │
//! template's Features ── match_features (ratio test) ◄────────────────┘
//!                             │
//!              fit_similarity (RANSAC, more than chance) ─► matches at the pose (kd-tree) ─► RotationEstimate
//! masks ─► outlines aligned, if there are too few keypoints ────────────────────────────────┘
//! ```
//!
//! **Frames.** As in `sdg_geometry`: the centre of the first pixel is at (0.5, 0.5), y points down, a positive angle is
//! clockwise as seen. Intensities are from 0 to 1.
//!
//! **Speed and determinism.** Rows and keypoints are distributed over rayon's threads, and plain loops use the widest
//! registers of the processor. Products and sums are never fused and never reordered, so results do not depend on
//! threads or processor. The crate's README compares it with OpenCV.
//!
//! Not included: colour, affine shape, databases of many images, grasps and cameras.
//!
//! # Source
//! D. Lowe, *Distinctive image features from scale-invariant keypoints*, IJCV 2004.
//!
//! # Example
//!
//! ```
//! use sdg_sift::{Plane, RotationConfig, RotationEstimator, Sift, SiftConfig};
//!
//! // A part of five dots, and the same part rotated by 90°.
//! let dots = [(60.0, 50.0, 6.0), (90.0, 52.0, 4.0), (75.0, 75.0, 5.0), (58.0, 82.0, 3.5), (95.0, 88.0, 4.5)];
//! let image = |turned: bool| {
//!     Plane::from_fn(150, 150, |x, y| {
//!         let (x, y) = (f64::from(x) + 0.5, f64::from(y) + 0.5);
//!         let (x, y) = if turned { (y, 150.0 - x) } else { (x, y) };
//!         let dot = |&(u, v, sigma): &(f64, f64, f64)| (-((x - u).powi(2) + (y - v).powi(2)) / (2.0 * sigma * sigma)).exp();
//!         0.2 + 0.6 * dots.iter().map(dot).sum::<f64>() as f32
//!     })
//! };
//! let estimator = RotationEstimator::new(Sift::new(SiftConfig::default())?, RotationConfig::default())?;
//! let template = estimator.template(&image(false), None)?;
//! let estimate = estimator.estimate(&template, &image(true), None)?.expect("five dots agree");
//! assert!((estimate.angle.degrees() - 90.0).abs() < 0.5);
//! # Ok::<(), sdg_sift::SiftError>(())
//! ```

#![forbid(unsafe_code)]
#![cfg_attr(test, allow(clippy::unwrap_used))]

mod blur;
mod config;
mod descriptor;
mod error;
mod extrema;
mod features;
mod gradient;
mod guided;
mod matching;
mod orientation;
mod plane;
mod ransac;
mod rotation;
mod scale_space;
mod sift;
mod silhouette;

pub use config::{DescriptorNormalization, SiftConfig};
pub use descriptor::DESCRIPTOR_LENGTH;
pub use error::SiftError;
pub use features::{Descriptor, Features, SiftKeypoint};
pub use matching::{FeatureMatch, match_features};
pub use plane::Plane;
pub use ransac::{KeypointPair, RansacConfig, SimilarityFit, fit_similarity};
pub use rotation::{RotationConfig, RotationEstimate, RotationEstimator, RotationMethod, RotationTemplate};
pub use sift::Sift;

/// Includes the README, so that its example is tested with the other examples.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
