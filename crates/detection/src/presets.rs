//! Presets of the detector's configuration.

mod detectron2;
mod edge;
mod torchvision;

use crate::config::BoxCoderConfig;

pub use detectron2::r50_detectron2;
pub use edge::{edge, edge_of};
pub use torchvision::r50_torchvision;

const UNIT_WEIGHTS: BoxCoderConfig = BoxCoderConfig { weights: [1.0, 1.0, 1.0, 1.0] };
/// Mean of the colours of ImageNet, red first, in [0, 1].
const IMAGENET_MEAN: [f32; 3] = [0.485, 0.456, 0.406];
/// Standard deviation of the colours of ImageNet, red first, for colours in [0, 1].
const IMAGENET_STD: [f32; 3] = [0.229, 0.224, 0.225];
const ROI_WEIGHTS: BoxCoderConfig = BoxCoderConfig { weights: [10.0, 10.0, 5.0, 5.0] };

/// The output of a detector's second stage.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RcnnKind {
    /// Boxes and classes.
    Faster {
        /// Object classes, without background.
        num_classes: usize,
    },
    /// Boxes and keypoints of one class.
    Keypoint {
        /// Number of keypoints per object.
        num_keypoints: usize,
    },
    /// Boxes, classes and masks.
    Mask {
        /// Object classes, without background.
        num_classes: usize,
    },
}

impl RcnnKind {
    fn num_classes(self) -> usize {
        match self {
            Self::Faster { num_classes } | Self::Mask { num_classes } => num_classes,
            Self::Keypoint { .. } => 1,
        }
    }
}
