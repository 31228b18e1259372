//! The value types that the other crates use: boxes, polygons, masks, keypoints, angles, the pinhole camera and the
//! planar grasp; and functions that several crates need, such as the convex hull, percentiles and a compass search.
//!
//! ```text
//! annotation ─ BoundingBox, GraspLine, Polygon ─┐
//! network    ─ BoundingBox, Keypoint, Mask ─────┼─ PlanarGrasp ─ PosedCamera ─ Ray ─ point on the grasp plane
//! shape      ─ PlanarSimilarity ────────────────┘
//! ```
//!
//! **Frames.** Pixels: x right, y down, the centre of the first pixel at (0.5, 0.5), so an image of width `w` spans
//! `[0, w]`. Camera: the optical frame, x right, y down, z forward. World: the target of `world_from_camera`; in this
//! project the frame named in the camera file (the robot's base or the table). Angles are in radians.
//!
//! Not in this crate: pictures (the `image` crate), tensors (burn) and files.
//!
//! ```
//! use sdg_geometry::{GraspLine, PlanarGrasp};
//! use nalgebra::Point2;
//!
//! let line = GraspLine::new(Point2::new(10.0, 20.0), Point2::new(30.0, 20.0));
//! let grasp = PlanarGrasp::from_keypoints(&line.keypoints(12), 18.0).expect("twelve visible keypoints");
//! assert!((grasp.x - 20.0).abs() < 1e-9 && grasp.angle.degrees().abs() < 1e-9);
//! ```
#![forbid(unsafe_code)]
#![cfg_attr(test, allow(clippy::unwrap_used))]

mod angle;
mod bounding_box;
mod camera;
mod compass_search;
mod convex_hull;
mod error;
mod keypoint;
mod mask;
mod mount;
mod outline;
mod planar_grasp;
mod planar_similarity;
mod polygon;
mod polygon_thinning;
mod rotational_symmetry;
mod slant;
mod statistics;

pub use angle::Angle;
pub use bounding_box::BoundingBox;
pub use camera::{PinholeCamera, PlanView, PlanViewError, PlumbBob, PosedCamera, Ray, Workspace};
pub use compass_search::CompassSearch;
pub use convex_hull::convex_hull;
pub use error::GeometryError;
pub use keypoint::{GraspLine, Keypoint, Visibility};
pub use mask::{Mask, RunLengthMask};
pub use mount::Mount;
pub use nalgebra;
pub use outline::{outer_boundary, outer_outline};
pub use planar_grasp::PlanarGrasp;
pub use planar_similarity::PlanarSimilarity;
pub use polygon::Polygon;
pub use rotational_symmetry::RotationalSymmetry;
pub use slant::Slant;
pub use statistics::{median, percentile, upper_median};

/// Runs the README's example with the other doc tests.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
