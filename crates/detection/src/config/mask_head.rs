//! The mask head's part of the configuration.

use serde::{Deserialize, Serialize};

use super::roi_pooler::RoiPoolerConfig;

/// Method of computing the target of an object's mask logits from its outline.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum MaskTargets {
    /// Polygons are filled in the box by COCO's rasteriser; bitmaps are pooled and thresholded at one half:
    /// Detectron2.
    Rasterized,
    /// The mask of the whole image is pooled by ROIAlign with legacy alignment, and fractions are kept: torchvision.
    Pooled,
}

/// Method of converting the mask of a box to a mask of the image.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum MaskPasting {
    /// Every pixel's centre is looked up in the box; zero outside the box: Detectron2.
    PixelCenters,
    /// The mask, padded by one zero cell on each side, is resized to the box in whole pixels: torchvision.
    WholePixels,
}

/// Weight in the loss of a cell inside the part, relative to a cell outside it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum MaskBalance {
    /// Equal: Detectron2 and torchvision.
    #[default]
    Cells,
    /// Larger if the part fills little of its box: the square root of the ratio of outside to inside cells, at most
    /// [`MaskBalance::MAX`]. A pipe fills a tenth of its box; with equal weights, a head trained for 300 steps learnt
    /// to mark no cell.
    ThinParts,
}

impl MaskBalance {
    /// Maximum weight of a cell inside the part.
    pub const MAX: f32 = 4.0;

    /// The weight of a cell inside the part, given the number of inside cells and the number of all `cells`.
    pub(crate) fn weight(self, inside: f32, cells: usize) -> f32 {
        match self {
            Self::Cells => 1.0,
            Self::ThinParts => ((cells as f32 - inside) / inside.max(1.0)).sqrt().clamp(1.0, Self::MAX),
        }
    }
}

/// Convolutions, a transposed convolution, and one map for each class.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MaskHeadConfig {
    /// How features are pooled for an ROI.
    pub pooler: RoiPoolerConfig,
    /// Channels of each 3×3 convolution.
    pub conv_channels: Vec<usize>,
    /// Channels of the transposed convolution.
    pub deconv_channels: usize,
    /// Maximum number of positive proposals per image that go through the head in training.
    pub max_train_rois_per_image: Option<usize>,
    /// Factor on the mask loss.
    pub loss_weight: f64,
    /// Weights of the cells in the mask loss.
    #[serde(default)]
    pub balance: MaskBalance,
    /// The targets of the logits.
    pub targets: MaskTargets,
    /// Method of pasting a mask into the image.
    pub pasting: MaskPasting,
    /// Minimum probability at which a pixel counts as inside the object.
    pub threshold: f64,
}

impl MaskHeadConfig {
    /// Side of the masks: the pooled side doubled by the transposed convolution.
    pub fn mask_size(&self) -> usize {
        self.pooler.output_size * 2
    }
}
