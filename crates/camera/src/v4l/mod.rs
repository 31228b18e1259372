//! Cameras of Video4Linux 2, by the crate `linuxvideo`: Linux alone.
//!
//! ```text
//! /dev/video* ── nodes: what each offers ── choice: encoding and size ── stream: buffers to pictures
//! ```
//! The driver's own frame counter and time are not to be had: frames are numbered as they are read, and carry the time at which they
//! were read.

#[cfg_attr(not(target_os = "linux"), allow(dead_code))]
mod choice;
#[cfg(target_os = "linux")]
mod nodes;
#[cfg(target_os = "linux")]
mod stream;

use std::path::PathBuf;

pub use choice::Sizes;

use crate::options::Encoding;

/// A V4L2 node that captures pictures.
#[derive(Debug, Clone, PartialEq)]
pub struct Node {
    /// As in `/dev/video0`.
    pub path: PathBuf,
    /// The card's name.
    pub name: String,
    /// The driver's name.
    pub driver: String,
    /// Where it is attached.
    pub bus: String,
    /// What it offers, in the driver's order.
    pub formats: Vec<Format>,
}

/// One way in which a node delivers its pictures.
#[derive(Debug, Clone, PartialEq)]
pub struct Format {
    /// V4L2's four letters.
    pub fourcc: String,
    /// The driver's description.
    pub description: String,
    /// The encoding, where it is one that is read here.
    pub encoding: Option<Encoding>,
    /// The sizes.
    pub sizes: Sizes,
    /// The highest frame rate of each of [`Sizes::Listed`], in frames a second; 0 where the driver does not say. Empty for an encoding
    /// that is not read here.
    pub max_fps: Vec<f64>,
}

/// The nodes of this machine that capture pictures, in the order of their numbers; none where V4L2 is missing.
#[cfg(target_os = "linux")]
pub fn nodes() -> Vec<Node> {
    nodes::nodes()
}

/// None: V4L2 is Linux's.
#[cfg(not(target_os = "linux"))]
pub fn nodes() -> Vec<Node> {
    Vec::new()
}

#[cfg(target_os = "linux")]
pub(crate) use stream::open;

/// V4L2 is Linux's.
#[cfg(not(target_os = "linux"))]
pub(crate) fn open(
    name: &crate::NodeName,
    _options: &crate::OpenOptions,
) -> Result<Box<dyn crate::source::Source>, crate::CameraError> {
    let address = crate::Address::V4l(name.clone()).to_string();
    Err(crate::CameraError::Open { address, why: "expected Linux, which alone has V4L2".to_owned() })
}
