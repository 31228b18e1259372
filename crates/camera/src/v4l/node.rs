//! A V4L2 node: its formats and their sizes.

use std::path::PathBuf;

use crate::options::Encoding;

/// A V4L2 node that captures pictures.
#[derive(Debug, Clone, PartialEq)]
pub struct Node {
    /// Path such as `/dev/video0`.
    pub path: PathBuf,
    /// The name of the card.
    pub name: String,
    /// The name of the driver.
    pub driver: String,
    /// The bus address.
    pub bus: String,
    /// The formats of the node, in the driver's order.
    pub formats: Vec<Format>,
}

/// A pixel format of a node.
#[derive(Debug, Clone, PartialEq)]
pub struct Format {
    /// V4L2's four-character code.
    pub fourcc: String,
    /// The driver's description of the format.
    pub description: String,
    /// The encoding, if supported.
    pub encoding: Option<Encoding>,
    /// Sizes in pixels: a list, or a range.
    pub sizes: Sizes,
    /// Maximum frame rate of each of [`Sizes::Listed`], in frames per second; 0 if the driver does not state it. Empty
    /// for a range, and for an unsupported encoding.
    pub max_fps: Vec<f64>,
}

/// The sizes of a format, in pixels.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Sizes {
    /// A list of widths and heights.
    Listed(Vec<(u32, u32)>),
    /// All sizes in a range, which the driver may round.
    Range {
        /// The smallest width and height.
        min: (u32, u32),
        /// The largest width and height.
        max: (u32, u32),
    },
}

impl Sizes {
    /// The size whose width and height differ least from the wanted ones, and its index in the list; 0 for a range.
    pub(super) fn nearest(&self, wanted: (u32, u32)) -> Option<((u32, u32), usize)> {
        match self {
            Self::Listed(sizes) => {
                let differs = |size: &(u32, u32)| size.0.abs_diff(wanted.0) + size.1.abs_diff(wanted.1);
                sizes.iter().enumerate().min_by_key(|(_, size)| differs(size)).map(|(place, size)| (*size, place))
            }
            Self::Range { min, max } => {
                let clamped = |wanted: u32, min: u32, max: u32| wanted.max(min).min(max);
                Some(((clamped(wanted.0, min.0, max.0), clamped(wanted.1, min.1, max.1)), 0))
            }
        }
    }
}
