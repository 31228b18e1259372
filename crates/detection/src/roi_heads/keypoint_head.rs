//! The keypoint head: computes a heatmap over the box for each keypoint.
//!
//! Shapes: R ROIs, C channels, P side of the pooled square, K keypoints, S = 4·P side of a heatmap.
//!
//! ```text
//! pooled [R, C, P, P] ─ 3×3 convolutions ─ transposed [R, K, 2P, 2P] ─ bilinear [R, K, S, S]
//! ```

use burn::module::Module;
use burn::tensor::Tensor;
use sdg_layers::{Conv2d, ConvTranspose2x, Initializer, upsample_bilinear_2x};

use crate::config::KeypointHeadConfig;
use crate::host::read;
use crate::losses;
use crate::roi_pooler::{Roi, pool};

use super::head_convs;
use super::heatmap::{decode, encode};
use super::roi::{RoiClass, RoiDetection, SampledRoi};
use crate::target::ResizedTarget;

/// Convolutions, a transposed convolution and an upsampling: heatmap logits of each keypoint.
#[derive(Module, Debug)]
pub struct KeypointHead {
    /// 3×3 convolutions; Detectron2's `conv_fcn1` is number 0.
    pub conv_fcn: Vec<Conv2d>,
    /// Transposed convolution to one map per keypoint.
    pub score_lowres: ConvTranspose2x,
    #[module(skip)]
    config: KeypointHeadConfig,
}

impl KeypointHead {
    /// Initialises the parameters at random, for a pyramid of `channels` channels.
    pub fn init(config: &KeypointHeadConfig, channels: usize, init: &mut Initializer) -> Self {
        let conv_fcn = head_convs::init(channels, &config.conv_channels, init);
        let in_channels = config.conv_channels.last().copied().unwrap_or(channels);
        Self {
            conv_fcn,
            score_lowres: ConvTranspose2x::init(in_channels, config.num_keypoints, 4, init),
            config: config.clone(),
        }
    }

    /// Maximum number of ROIs per image in training.
    pub(super) fn max_train_rois_per_image(&self) -> Option<usize> {
        self.config.max_train_rois_per_image
    }

    /// Returns heatmap logits `[R, K, S, S]`.
    pub fn forward(&self, features: &[Tensor<4>; 5], rois: &[Roi]) -> Tensor<4> {
        upsample_bilinear_2x(self.score_lowres.forward(self.hidden(features, rois)))
    }

    /// Returns the maps `[R, C, P, P]` from which the heatmaps are computed; `C` is the number of channels of the last
    /// convolution.
    pub fn hidden(&self, features: &[Tensor<4>; 5], rois: &[Roi]) -> Tensor<4> {
        let pooled = pool(features, rois, &self.config.pooler);
        self.conv_fcn.iter().fold(pooled, |x, conv| conv.forward_relu(x))
    }

    /// Returns the cross-entropy over the cells, divided by the number of keypoints with a cell, times the configured
    /// weight.
    pub fn loss(&self, features: &[Tensor<4>; 5], rois: &[SampledRoi], targets: &[ResizedTarget]) -> Tensor<1> {
        let size = self.config.heatmap_size();
        let cells: Vec<Option<usize>> = rois
            .iter()
            .flat_map(|SampledRoi { roi, class }| match *class {
                RoiClass::Background => vec![None; self.config.num_keypoints],
                RoiClass::Object { gt_idx, .. } => targets[roi.image_idx].keypoints[gt_idx]
                    .iter()
                    .map(|keypoint| encode(keypoint, &roi.corners, size))
                    .collect(),
            })
            .collect();
        let count = cells.iter().flatten().count();
        if count == 0 {
            return Tensor::zeros([1], &features[0].device());
        }
        let boxes: Vec<Roi> = rois.iter().map(|sampled| sampled.roi).collect();
        let logits = self.forward(features, &boxes);
        let [r, k, _, _] = logits.dims();
        let sum = losses::cross_entropy(logits.reshape([r * k, size * size]), &cells);
        sum * (self.config.loss_weight / count as f64)
    }

    /// Reads the keypoints of every detection.
    pub async fn read_keypoints(&self, features: &[Tensor<4>; 5], detections: &mut [Vec<RoiDetection>]) {
        let rois: Vec<Roi> = detections
            .iter()
            .enumerate()
            .flat_map(|(image_idx, found)| {
                found.iter().map(move |detection| Roi { image_idx, corners: detection.corners })
            })
            .collect();
        if rois.is_empty() {
            return;
        }
        let size = self.config.heatmap_size();
        let logits = read(self.forward(features, &rois)).await;
        let maps_of_roi = logits.chunks_exact(self.config.num_keypoints * size * size);
        for (detection, maps) in detections.iter_mut().flatten().zip(maps_of_roi) {
            detection.keypoints = maps
                .chunks_exact(size * size)
                .map(|map| {
                    let (readout, score) = (self.config.readout, self.config.score);
                    decode(map, size, &detection.corners, readout, score)
                })
                .collect();
        }
    }
}
