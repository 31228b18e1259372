//! Inputs and outputs of the ROI heads.

use crate::boxes::Corners;
use crate::roi_pooler::Roi;

use super::heatmap::ReadKeypoint;
use super::mask_paste::BoxMask;

/// A sampled proposal of the losses.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SampledRoi {
    /// Box and image.
    pub roi: Roi,
    /// Background, or the class and the index of the object in its image.
    pub class: RoiClass,
}

/// The result of matching a sampled proposal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RoiClass {
    /// No object.
    Background,
    /// An object of the image.
    Object {
        /// Index of the class, from 0 without the background.
        class_idx: usize,
        /// Index of the object among the objects of the image.
        gt_idx: usize,
    },
}

/// A detection in pixels of the resized image.
#[derive(Debug, Clone, PartialEq)]
pub struct RoiDetection {
    /// Box.
    pub corners: Corners,
    /// Probability of the class.
    pub score: f32,
    /// Index of the class, from 0 without the background.
    pub class_idx: usize,
    /// Keypoints, empty without a keypoint head.
    pub keypoints: Vec<ReadKeypoint>,
    /// Mask over the box, with a mask head.
    pub mask: Option<BoxMask>,
}
