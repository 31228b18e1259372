//! One file for each verb.

#[cfg(feature = "annotate")]
pub mod annotate;
pub mod annotation;
pub mod augment;
pub mod camera;
pub mod completions;
#[cfg(feature = "simulation")]
pub mod demo;
pub mod detect;
mod detect_live;
pub mod devices;
#[cfg(feature = "simulation")]
pub mod evaluate;
#[cfg(feature = "simulation")]
pub mod evaluate_axes;
#[cfg(feature = "simulation")]
pub mod evaluate_cameras;
pub mod evaluate_pictures;
pub mod grasp;
pub mod man;
#[cfg(feature = "simulation")]
pub mod rehearse;
pub mod robot;
#[cfg(feature = "simulation")]
pub mod simulate;
pub mod teach;
pub mod weights;
