//! The mask head's part of the configuration.

use serde::{Deserialize, Serialize};

use super::roi_pooler::RoiPoolerConfig;

/// From an object's outline to what its mask logits should be.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum MaskTargets {
    /// Polygons are drawn into the box by COCO's rasteriser; bitmaps are pooled and cut at one half: Detectron2.
    Rasterized,
    /// The mask of the whole image is pooled by ROIAlign in the legacy alignment, fractions kept: torchvision.
    Pooled,
}

/// From the mask of a box to a mask of the image.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum MaskPasting {
    /// Every pixel's centre is looked up in the box, zeros outside: Detectron2.
    PixelCenters,
    /// The mask, one zero cell wider on each side, is resized to the box in whole pixels: torchvision.
    WholePixels,
}

/// What a cell of the part weighs in the loss against one beside it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum MaskBalance {
    /// As much: Detectron2 and torchvision.
    #[default]
    Cells,
    /// More where the part fills little of its box: the root of how many cells there are beside it for one of it, at most
    /// [`MaskBalance::MAX`]. A pipe fills a tenth of its box, and a head taught for 300 steps learnt that nothing is
    /// ever part of it.
    ThinParts,
}

impl MaskBalance {
    /// The most that a cell of the part weighs.
    pub const MAX: f32 = 4.0;

    /// The weight of a cell of the part, by how many of all `cells` are.
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
    /// Most positive proposals an image that go through the head while training.
    pub max_train_rois_per_image: Option<usize>,
    /// Factor on the mask loss.
    pub loss_weight: f64,
    /// What cells weigh in it.
    #[serde(default)]
    pub balance: MaskBalance,
    /// What the logits are taught.
    pub targets: MaskTargets,
    /// How a mask gets into the image.
    pub pasting: MaskPasting,
    /// Least probability of a pixel inside.
    pub threshold: f64,
}

impl MaskHeadConfig {
    /// Side of the masks: the pooled side doubled by the transposed convolution.
    pub fn mask_size(&self) -> usize {
        self.pooler.output_size * 2
    }
}
