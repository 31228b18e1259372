//! Cameras of Video4Linux 2, with the crate `linuxvideo`: Linux only.
//!
//! ```text
//! /dev/video* ── nodes: formats of each ── choice: encoding and size ── stream: buffers to pictures
//! ```
//! The driver's frame counter and timestamps are not accessible: frames are numbered when they are read, and have the
//! time at which they were read.

#[cfg_attr(not(target_os = "linux"), allow(dead_code))]
mod choice;
mod node;
#[cfg(target_os = "linux")]
mod nodes;
#[cfg(target_os = "linux")]
mod stream;

pub use node::{Format, Node, Sizes};

/// The nodes of this machine that capture pictures, in the order of their numbers; empty without V4L2.
#[cfg(target_os = "linux")]
pub fn nodes() -> Vec<Node> {
    nodes::nodes()
}

/// No nodes: V4L2 exists only on Linux.
#[cfg(not(target_os = "linux"))]
pub fn nodes() -> Vec<Node> {
    Vec::new()
}

#[cfg(target_os = "linux")]
pub(crate) use stream::open;

/// Always fails: V4L2 exists only on Linux.
#[cfg(not(target_os = "linux"))]
pub(crate) fn open(
    name: &crate::NodeName,
    _options: &crate::OpenOptions,
) -> Result<Box<dyn crate::source::Source>, crate::CameraError> {
    let address = crate::Address::V4l(name.clone()).to_string();
    Err(crate::CameraError::Open { address, why: "expected Linux: V4L2 exists only there".to_owned() })
}
