//! Grasp models: taught from one annotated photo, they find planar grasps in images.
//!
//! ```text
//! Demonstration ─ teach ─ GraspModel ─ detect ─ GraspDetection ─ PlanarGrasp ─ GraspPose (base_from_tcp)
//!                             │
//!                    to_bytes / from_bytes: one self-describing file
//! ```
//!
//! Five models, by their letters ([`ModelKind`]): the paper's four models, which differ in the output of their network
//! (a box and its crop, keypoints, a mask), and one without a network, taught in a second. Each box of a network is
//! converted to a pose of the demonstration. [`Verification`] refines and scores this pose by laying the demonstration
//! over the image.
//!
//! # Legend
//!
//! | symbol | is |
//! |---|---|
//! | image | the picture as given, or the plan view made of it ([`CameraOverTable`]); pixels, y down, the first pixel's centre at (0.5, 0.5) |
//! | photo | the demonstration's picture, in its pixels |
//! | cut-out | the crop of the photo around the part that the model stores, in its pixels |
//! | view, working | the halved image and the resized cut-out for one range of sizes; the search compares these |
//! | `a_from_b` | a transform of coordinates from frame b to frame a; poses are `image_from_cutout`, a similarity |
//! | candidate | a box of the network converted to a pose, not yet verified |
//! | evidence | measurements at a pose (edges, surface, hue, visible fraction, size …), each of which adds log-odds to the score |
//! | score | logistic function of the sum of log-odds, in (0, 1); a detection of at least 0.5 is accepted |
//! | agreement | edges and surface together, in [0, 1], from `sdg-shape` |
//! | `log_size` | ln of the size in the image over that in the photo, in pixels |
//! | x, y, angle, width | a planar grasp: centre in pixels, angle of the grasp line from x towards y, opening in pixels |
//! | tcp, flange, base | frames of the arm; metres, z of the tcp along the approach |
//!
//! This crate deliberately uses no files, robot or simulator. Detection uses no clock and no threads except rayon's:
//! the same code runs in a browser. Without the feature `teach` no autodiff, optimiser or augmentation is compiled.
//!
//! From the bytes of a model and of an image to a grasp:
//!
//! ```no_run
//! use sdg_grasp::{Device, GraspModel, ImageLimits, Verification, decode_image};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let model = GraspModel::from_bytes(&std::fs::read("pendulum.sdg")?, &Device::flex())?;
//! let image = decode_image(&std::fs::read("table.png")?, &ImageLimits::default())?;
//! let found = model.detect(&image, Verification::ByShape)?;
//! match found.first().filter(|best| best.is_accepted()) {
//!     Some(best) => println!("grasp at ({:.1}, {:.1}), {:.1}°", best.grasp.x, best.grasp.y, best.grasp.angle.degrees()),
//!     None => println!("nothing to grasp"),
//! }
//! # Ok(())
//! # }
//! ```
#![forbid(unsafe_code)]
#![cfg_attr(test, allow(clippy::unwrap_used))]

#[cfg(feature = "teach")]
mod base_weights;
#[cfg(feature = "teach")]
mod base_weights_file;
mod check_config;
mod colors;
mod cutout_budget;
mod decimal;
mod detection;
mod device;
#[cfg(all(test, feature = "teach"))]
mod drawn_part;
mod error;
mod evidence_kind;
mod explanation;
mod facts;
#[cfg(feature = "fitting")]
pub mod fitting;
mod lengths;
mod marks_shift;
mod model;
mod model_file;
mod models;
mod network_calibration;
mod network_evidence;
mod photo_scale;
mod plan_view;
mod pose;
mod prepared;
mod record;
mod region;
#[cfg(all(test, feature = "teach"))]
mod region_tests;
mod round_top;
mod safetensors_file;
mod same_part;
mod score_calibration;
mod search_window;
mod sighting;
mod sizes;
mod slanted;
mod taught;
mod taught_marks;
#[cfg(feature = "teach")]
mod teach;
mod tracking;
mod verdict;
mod verification;

#[cfg(feature = "teach")]
pub use base_weights::BaseWeights;
#[cfg(feature = "teach")]
pub use base_weights_file::BaseWeightsFile;
pub use burn::tensor::Device;
pub use check_config::{CheckConfig, ScoreConfig, Term};
pub use detection::GraspDetection;
pub use device::ComputeBackend;
pub use error::{GraspError, Result};
pub use evidence_kind::{Advice, EvidenceKind};
pub use facts::{ModelKind, NegativeFacts, OrientationFacts, TeachingFacts, TurnSource, ValidationFacts};
pub use lengths::{EdgeHeight, Lengths};
pub use model::{GraspModel, Verification};
pub use model_file::{FORMAT_VERSION, ModelSummary, summarize};
pub use network_calibration::NetworkCalibration;
pub use plan_view::{
    CameraOverTable, Circumstances, ErrorLength, PlanViewDetection, PlanViewDetector, PlanarPose, Uncertainty,
    check_region_from_above, pictures_from_above, seen_from_above,
};
pub use pose::{GraspPlane, GraspPose};
pub use record::{DetectionRecord, GraspRecord};
pub use region::{RegionError, SearchRegion};
pub use sdg_demonstration::{ImageLimits, NUM_KEYPOINTS, decode_image};
pub use sdg_detection::keep_freed_memory;
pub use sdg_shape::Differences;
#[cfg(feature = "teach")]
pub use sdg_training::{Ending, HIT_DEGREES, HIT_PX, History, LossValues, StepRecord, Validation, ValidationRecord};
pub use taught::TaughtDemonstration;
pub use taught_marks::TaughtMarks;
#[cfg(feature = "teach")]
pub use teach::{
    AcceptedNegative, FineTuning, Preset, Start, Taught, TeachOptions, TeachingEvent, TurnedGrasp,
    check_teaching_region, teach, turned_grasps, without_unmarked_parts,
};
pub use tracking::{PartDetector, PartSearch, SearchOutcome, TrackState, TrackedPart, Tracker, TrackerConfig};
pub use verdict::Contributions;

/// Includes the README, so that its example is tested with the other examples.
#[cfg(all(doctest, feature = "teach"))]
#[doc = include_str!("../README.md")]
struct Readme;
