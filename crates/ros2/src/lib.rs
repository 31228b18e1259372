//! ROS 2 without a ROS installation: its messages and, with the feature `dds`, its network.
//!
//! ```text
//! bytes ─ cdr ─ messages ─ encoding: pictures │ camera_info: PinholeCamera │ transforms: frames │ found: detections, poses
//! feature dds:  Node ─ Subscription, Publisher, Server, ActionClient ─ RosCamera (camera's trait), TrajectoryArm (robot's trait)
//! ```
//! This crate checks all data from the network: an invalid message causes an error text, never a panic.
//!
//! Not included: grasp models (crate `ros2-node` connects them to a node), big-endian peers, ROS 2 itself.
//!
//! ```
//! use sdg_ros2::{cdr, encoding, messages::{Header, Image}};
//!
//! let picture = image::RgbImage::from_pixel(4, 2, image::Rgb([1, 2, 3]));
//! let bytes = cdr::to_bytes(&encoding::to_image(&picture, Header::default()));
//! let message: Image = cdr::from_bytes(&bytes)?;
//! assert_eq!(encoding::read_image(&message)?, picture);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
#![forbid(unsafe_code)]
#![cfg_attr(test, allow(clippy::unwrap_used))]

pub mod camera_info;
pub mod cdr;
#[cfg(feature = "dds")]
pub mod dds;
pub mod encoding;
mod error;
pub mod found;
pub mod messages;
mod names;
mod transforms;

pub use error::{PictureError, RosError};
pub use names::{Naming, Remapping};
pub use transforms::Transforms;
