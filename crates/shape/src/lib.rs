//! The demonstration laid over an image: whether the part is there, and its pose to a fraction of a pixel.
//!
//! A detector taught from one photo also gives detections on other parts, and its poses have errors of some pixels.
//! Laying the demonstration over the image decides whether the detection is the part, and corrects the pose. The part's
//! edges are read from the demonstration once; at a predicted pose their directions are compared with the directions of
//! the image's gradients (sign ignored, since the background changes), and the pose climbs from there in x, y, angle
//! and scale.
//!
//! ```text
//! demonstration, outline ──► ShapeTemplate   edge points per pyramid level, weighted
//!                                 │
//! image ──► GradientField ────────┼──► agreement(pose)   in [0, 1]
//!           directions, pyramid   └──► refine(pose) ──► Refinement { pose, agreement }
//! ```
//! [`Surface`] compares the colours inside the outline, [`Structure`] the edges over the whole area, also edges in only
//! one of the two pictures; a [`Comparison`] scores edges and surface together and collects the [`Evidence`] for a
//! pose. [`ShapeSearch`] needs no detector: it coarsely tries every position, angle and scale in a whole image and
//! refines the best. [`ShapeConfig`] holds the fitted values, with their origin.
//!
//! # Legend
//!
//! | symbol | is |
//! |---|---|
//! | demonstration, image | the two pictures; pixels, y down, the first pixel's centre at (0.5, 0.5) |
//! | pose | `image_from_demonstration`: shift (x, y), angle, scale `s`; while it is refined, about the part's centre, with ln `s` |
//! | level m | of a pyramid: its pixel is 2^m pixels wide |
//! | φ | direction of a gradient, without sign; kept as (cos 2φ, sin 2φ) times a length in [0, 1] |
//! | edge point | a point of the demonstration's edges: offset from the centre, normal, weight; weights of a level sum to 1 |
//! | alignment | cos 2(φ of the edge point − φ of the image there), in [-1, 1] |
//! | agreement | weighted mean of alignments (edges), or of correlations (surface), in [0, 1] |
//! | agreement's level | the pyramid level of the template at which agreement is computed |
//! | crest | a local maximum of the gradient's energy along an edge point's normal |
//! | bank | the template turned and scaled in all variants that the search tries |
//! | place, pitch | where the search puts the part's centre, and the distance between two such places |
//! | likeness | log-odds of a small network that photo and picture show the same part |
//! | details | log-odds of a second network, trained on parts and their look-alikes |
//!
//! This crate plans no grasp; only [`PlanViewMap`] uses a camera. Parts lie flat: poses are rotations, shifts and
//! scales in the image plane. The crate uses threads only with the feature `parallel`, and results do not depend on
//! them.
//!
//! # Example
//!
//! ```
//! use image::{Rgb, RgbImage};
//! use nalgebra::Point2;
//! use sdg_geometry::{Angle, BoundingBox, PlanarSimilarity, Polygon};
//! use sdg_shape::{GradientField, ShapeSearch, SearchConfig, ShapeConfig, ShapeTemplate};
//!
//! // A dark 80 × 40 plate in the demonstration, and the same plate 5 px further to the right.
//! let plate_at = |x: u32| {
//!     RgbImage::from_fn(200, 150, |col, row| {
//!         let on_plate = (x..x + 80).contains(&col) && (50..90).contains(&row);
//!         Rgb(if on_plate { [60, 60, 70] } else { [200, 190, 180] })
//!     })
//! };
//! let outline = Polygon::from_box(&BoundingBox { x1: 50.0, y1: 50.0, x2: 130.0, y2: 90.0 });
//! let mut config = ShapeConfig::default();
//! config.capture_shift = 0.04;
//! let template = ShapeTemplate::new(&plate_at(50), &outline, &config)?;
//!
//! let field = GradientField::new(&plate_at(55));
//! let refinement = template.refine(&field, &PlanarSimilarity::IDENTITY);
//! assert!((refinement.image_from_demonstration.apply(&Point2::new(90.0, 70.0)).x - 95.0).abs() < 0.2);
//! assert!(refinement.agreement > 0.9);
//!
//! // Without knowing where to start:
//! let search = ShapeSearch::new(&plate_at(50), &outline, &SearchConfig::default())?;
//! let matches = search.search(&plate_at(110));
//! assert!((matches[0].image_from_demonstration.apply(&Point2::new(90.0, 70.0)).x - 150.0).abs() < 0.2);
//! # Ok::<(), sdg_shape::ShapeError>(())
//! ```

#![forbid(unsafe_code)]
#![cfg_attr(test, allow(clippy::unwrap_used))]

mod alignment;
mod capture_range;
mod close_look;
mod comparison;
mod config;
mod consensus;
mod details;
mod edge_points;
mod error;
mod following;
mod foreshortening;
mod frame;
mod gradient_field;
mod lanes;
mod layers;
mod likeness;
pub mod parallel;
mod pixel_cell;
mod plan_view_map;
mod pose;
mod profile;
mod refinement;
mod revolution;
mod search;
mod sightings;
mod structure;
mod surface;
mod template;

pub use close_look::{CloseLook, RivalFit, TableColors};
pub use comparison::{Agreement, Comparison, Differences, Evidence, Picture};
pub use config::{
    AgreementConfig, GradientConfig, RefinementConfig, ScaleRange, ShapeConfig, StructureConfig, SurfaceConfig,
};
pub use details::Details;
pub use error::ShapeError;
pub use following::Reach;
pub use foreshortening::Foreshortening;
pub use gradient_field::GradientField;
pub use layers::Layer;
pub use likeness::{LAYERS, Likeness, LikenessNetwork, NUM_CHANNELS, NUM_HIDDEN, Pair, SIDE};
pub use plan_view_map::{PixelRect, PlanViewMap};
pub use refinement::Refinement;
pub use revolution::Revolution;
pub use search::{Match, SearchConfig, ShapeSearch};
pub use structure::{Structure, StructureAgreement};
pub use surface::Surface;
pub use template::ShapeTemplate;

/// Includes the README, so that its example is tested with the other examples.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
