//! The probability that photo and picture show the same part, computed by a small network from both, aligned.
//!
//! ```text
//! cut-out ────────────────────────┐
//!                                 ├─ 64×64 pixels each, the part about 53 long ─ network ─ log-odds of the same part
//! picture, sampled at the pose ───┘
//! ```
//! The agreements of edges and colours measure the amount of difference. The network distinguishes the causes: an
//! object that covers the part, its shadow, a highlight, or a hole at a wrong place. It was trained on generated parts
//! and is not specific to any part (docs/decisions/008-likeness.md).

mod network;
mod pair;

use image::RgbImage;
use sdg_geometry::{PlanarSimilarity, Polygon};

pub use self::network::{LAYERS, LikenessNetwork, NUM_HIDDEN};
use self::pair::Photo;
pub(crate) use self::pair::exposed_values;
pub use self::pair::{NUM_CHANNELS, Pair, SIDE};

/// A demonstration prepared for comparison with pictures by the network.
#[derive(Debug, Clone)]
pub struct Likeness {
    photo: Photo,
}

impl Likeness {
    /// Reads the part from its cut-out; `outline` is in pixels of the cut-out.
    pub fn new(cutout: &RgbImage, outline: &Polygon) -> Self {
        Self { photo: Photo::new(cutout, outline) }
    }

    /// The input of the network at a pose.
    pub fn pair(&self, image: &RgbImage, image_from_cutout: &PlanarSimilarity) -> Pair {
        self.photo.beside(image, image_from_cutout)
    }

    /// ln of the odds that the image shows the part at the pose instead of something similar, with the network's
    /// training ratio of three wrong poses for a right one.
    pub fn log_odds(&self, image: &RgbImage, image_from_cutout: &PlanarSimilarity) -> f64 {
        f64::from(LikenessNetwork::shipped().log_odds(&self.photo.values_beside(image, image_from_cutout)))
    }
}
