//! The comparison network: does a picture show the part of a demonstration at the model's pose?
//!
//! ```text
//! demonstration, outline ─ upright, S×S ────────────────┐
//!                                                       ├─ maps, cosines, differences ─ convolutions ─ log-odds
//! picture, pose ─ rotated upright by the pose, S×S ─────┘
//! ```
//!
//! The picture is cropped by the pose, so that the same point of the part is at the same pixel of both images, and the
//! network only judges their similarity. This question is the same for every part: the network is trained once, on
//! generated parts and their look-alikes, and teaching only adds the demonstration.
//!
//! **Frame of a view.** A square about the centre of the outline's box; x points right and y down in the
//! demonstration's image.
//!
//! Not in this crate: finding the part and its pose (crates `detection`, `grasp`), pretraining (`base-weights`), files.
//!
//! # Source
//! Comparison of two images by one network: Zagoruyko and Komodakis, Learning to Compare Image Patches via
//! Convolutional Neural Networks (2015). Log-odds of a pose, from a picture and a view of the object in that pose:
//! Labbé and others, MegaPose (2022).
//!
//! # Example
//! ```
//! use burn::tensor::{Device, read_sync};
//! use image::RgbImage;
//! use sdg_comparison::{ComparisonConfig, Pyramid, Reference};
//! use sdg_geometry::{BoundingBox, PlanarSimilarity, Polygon};
//!
//! let network = ComparisonConfig::edge().init(&Device::flex(), 7)?;
//! let outline = Polygon::from_box(&BoundingBox::new(20.0, 20.0, 100.0, 60.0)?);
//! let reference = Reference::new(&RgbImage::new(120, 80), &outline, network.config());
//! let picture = RgbImage::new(640, 480);
//! let view = reference.view(&Pyramid::new(&picture), &PlanarSimilarity::IDENTITY);
//! let compared = read_sync(network.compare(&[view]));
//! assert!(compared[0].log_odds.is_finite());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
#![forbid(unsafe_code)]
#![cfg_attr(test, allow(clippy::unwrap_used))]

mod alignment;
mod config;
mod network;
mod view;

pub use alignment::Alignment;
pub use config::{ComparisonConfig, ComparisonError};
pub use network::{Comparison, ComparisonNetwork};
pub use sdg_picture::Pyramid;
pub use view::{DIFFERENCES, Reference, View};
