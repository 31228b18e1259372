//! The probability that photo and picture show the same part, by a small network whose input is both, aligned.
//!
//! ```text
//! cut-out ────────────────────────┐
//!                                 ├─ 64×64 pixels each, the part about 53 long ─ network ─ log-odds of the same part
//! picture, turned and sized as it ┘
//! ```
//! Agreements of edges and colours count how much differs. The network can tell the causes apart: something lying over
//! the part, its shadow, a highlight, or a hole that belongs elsewhere. It was trained on generated parts and knows no part in
//! particular (docs/decisions/008-likeness.md).

mod network;
mod pair;

use image::RgbImage;
use sdg_geometry::{PlanarSimilarity, Polygon};

pub use self::network::{LAYERS, LikenessNetwork, NUM_HIDDEN};
use self::pair::Photo;
pub(crate) use self::pair::exposed_values;
pub use self::pair::{NUM_CHANNELS, Pair, SIDE};

/// A demonstration, ready to be compared with pictures by the network.
#[derive(Debug, Clone)]
pub struct Likeness {
    photo: Photo,
}

impl Likeness {
    /// Reads the part out of its cut-out; `outline` in its pixels.
    pub fn new(cutout: &RgbImage, outline: &Polygon) -> Self {
        Self { photo: Photo::new(cutout, outline) }
    }

    /// The input of the network at a pose.
    pub fn pair(&self, image: &RgbImage, image_from_cutout: &PlanarSimilarity) -> Pair {
        self.photo.beside(image, image_from_cutout)
    }

    /// ln of how much likelier the image shows the part at the pose than anything else that looks like it, as the network was
    /// trained: with three wrong poses for a right one.
    pub fn log_odds(&self, image: &RgbImage, image_from_cutout: &PlanarSimilarity) -> f64 {
        f64::from(LikenessNetwork::shipped().log_odds(&self.photo.values_beside(image, image_from_cutout)))
    }
}
