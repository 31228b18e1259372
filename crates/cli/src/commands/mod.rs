//! The commands, one file or folder each: arguments and implementation.

pub mod annotate;
pub mod annotation;
pub mod augment;
pub mod camera;
pub mod completions;
pub mod demo;
pub mod detect;
pub mod devices;
pub mod evaluate;
pub mod grasp;
pub mod man;
pub mod plan;
pub mod rehearse;
pub mod robot;
#[cfg(feature = "ros2")]
pub mod ros2;
#[cfg(feature = "simulation")]
pub mod simulate;
pub mod teach;
pub mod teach_folder;
pub mod weights;
pub mod workcell;
