//! The region proposal network: computes a score and a box for every anchor, then selects the best
//! ones.
//!
//! Shapes: N images, C channels, A anchors per cell, L anchors of an image over all levels, in the
//! order level, row, column, aspect ratio.
//!
//! Glossary: *objectness logits* are the scores of the anchors before the sigmoid; *deltas* describe a box relative to
//! its anchor; *proposals* are the boxes that remain after top-k and NMS. The network runs on the device; anchors,
//! matching, decoding and NMS run on the host, after one read of the network's outputs.

use burn::module::Module;
use burn::tensor::{Int, Tensor, read_sync};
use rand_pcg::Pcg64Mcg;
use sdg_layers::{Conv2d, Conv2dShape, Distribution, Initializer};

use crate::anchors::{GridSize, grid_anchors};
use crate::box_coder::BoxCoder;
use crate::boxes::{Corners, clip, is_usable};
use crate::config::{AnchorConfig, NormKind, RpnConfig, RpnNormaliser};
use crate::host::read_both;
use crate::losses;
use crate::matcher::{Match, match_boxes};
use crate::sampler::sample;

/// Standard deviation of the initial weights, in every layer of the head.
const HEAD_STD: f64 = 0.01;

/// The convolutions that are applied to every level.
#[derive(Module, Debug)]
pub struct RpnHead {
    /// 3×3.
    pub conv: Conv2d,
    /// 1×1 to A scores.
    pub objectness_logits: Conv2d,
    /// 1×1 to 4·A deltas.
    pub anchor_deltas: Conv2d,
}

/// Computes a score and a box for every anchor, and proposals from them.
#[derive(Module, Debug)]
pub struct RegionProposalNetwork {
    /// Convolutions with the same parameters for all levels.
    pub rpn_head: RpnHead,
    #[module(skip)]
    config: RpnConfig,
    #[module(skip)]
    anchor_config: AnchorConfig,
}

/// The head's output for a batch, with its anchors.
#[derive(Debug, Clone)]
pub struct RpnPredictions {
    /// Objectness of each anchor, `[N, L]`.
    pub objectness_logits: Tensor<2>,
    /// Deltas of each anchor, `[N, L, 4]`.
    pub deltas: Tensor<3>,
    /// Anchors of each level, L in total.
    pub anchors: [Vec<Corners>; 5],
}

/// Boxes that may contain an object, best first.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Proposals {
    /// Boxes in pixels of the resized image.
    pub boxes: Vec<Corners>,
    /// One logit per box, in the order of the boxes.
    pub objectness_logits: Vec<f32>,
}

/// Height and width of a resized image, without padding.
pub type ImageSize = [usize; 2];

/// Training or inference.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mode {
    /// Training; the numbers of proposals differ from those of inference.
    Train,
    /// Inference.
    Test,
}

impl RegionProposalNetwork {
    /// Initialises the parameters at random, for a pyramid of `channels` channels.
    pub fn init(config: &RpnConfig, anchors: &AnchorConfig, channels: usize, init: &mut Initializer) -> Self {
        let num_anchors = anchors.aspect_ratios.len();
        let normal = Distribution::Normal { std: HEAD_STD };
        let mut conv = |out_channels, kernel| {
            Conv2dShape::new(channels, out_channels, kernel).init(normal, NormKind::Identity, init)
        };
        Self {
            rpn_head: RpnHead {
                conv: conv(channels, 3),
                objectness_logits: conv(num_anchors, 1),
                anchor_deltas: conv(4 * num_anchors, 1),
            },
            config: config.clone(),
            anchor_config: anchors.clone(),
        }
    }

    /// Applies the head to every level.
    ///
    /// # Shapes
    /// - `features`: p2 to p6, `[N, C, H_l, W_l]`
    pub fn predict(&self, features: &[Tensor<4>; 5], padded_size: ImageSize) -> RpnPredictions {
        let grids = features.each_ref().map(|feature| {
            let [_, _, height, width] = feature.dims();
            GridSize { height, width }
        });
        let mut logits = Vec::with_capacity(5);
        let mut deltas = Vec::with_capacity(5);
        for feature in features {
            let hidden = self.rpn_head.conv.forward_relu(feature.clone());
            let objectness = self.rpn_head.objectness_logits.forward(hidden.clone());
            let level_deltas = self.rpn_head.anchor_deltas.forward(hidden);
            let [n, a, h, w] = objectness.dims();
            // [N, A, H, W] -> [N, H·W·A] and [N, A·4, H, W] -> [N, H·W·A, 4].
            logits.push(objectness.permute([0, 2, 3, 1]).reshape([n, h * w * a]));
            deltas.push(level_deltas.permute([0, 2, 3, 1]).reshape([n, h * w * a, 4]));
        }
        let [height, width] = padded_size;
        RpnPredictions {
            objectness_logits: Tensor::cat(logits, 1),
            deltas: Tensor::cat(deltas, 1),
            anchors: grid_anchors(&self.anchor_config, &grids, height, width),
        }
    }

    /// Selects the proposals of each image: the best anchors of each level, decoded, clipped,
    /// after NMS.
    pub fn propose(&self, predictions: &RpnPredictions, image_sizes: &[ImageSize], mode: Mode) -> Vec<Proposals> {
        read_sync(self.propose_async(predictions, image_sizes, mode))
    }

    /// [`Self::propose`], asynchronous.
    pub async fn propose_async(
        &self,
        predictions: &RpnPredictions,
        image_sizes: &[ImageSize],
        mode: Mode,
    ) -> Vec<Proposals> {
        let [logits, deltas] = read_both(predictions.objectness_logits.clone(), predictions.deltas.clone()).await;
        let num_anchors: usize = predictions.anchors.iter().map(Vec::len).sum();
        image_sizes
            .iter()
            .zip(logits.chunks_exact(num_anchors))
            .zip(deltas.chunks_exact(num_anchors * 4))
            .map(|((size, logits), deltas)| self.propose_image(&predictions.anchors, logits, deltas, *size, mode))
            .collect()
    }

    fn propose_image(
        &self,
        anchors: &[Vec<Corners>; 5],
        logits: &[f32],
        deltas: &[f32],
        [height, width]: ImageSize,
        mode: Mode,
    ) -> Proposals {
        let (pre_nms, post_nms) = match mode {
            Mode::Train => (self.config.pre_nms_top_n.train, self.config.post_nms_top_n.train),
            Mode::Test => (self.config.pre_nms_top_n.test, self.config.post_nms_top_n.test),
        };
        let coder = BoxCoder::new(&self.config.box_coder);
        let min_size = self.config.min_box_size_px as f32;
        let (mut boxes, mut scores, mut levels) = (Vec::new(), Vec::new(), Vec::new());
        let mut start = 0;
        for (level, level_anchors) in anchors.iter().enumerate() {
            let level_logits = &logits[start..start + level_anchors.len()];
            for idx in top_k(level_logits, pre_nms) {
                let at = (start + idx) * 4;
                let delta = [deltas[at], deltas[at + 1], deltas[at + 2], deltas[at + 3]];
                let decoded = coder.decode(&level_anchors[idx], &delta);
                // Clipping would turn infinite corners into the whole image.
                if !is_usable(&decoded, f32::NEG_INFINITY) {
                    continue;
                }
                let proposal = clip(&decoded, width as f32, height as f32);
                if is_usable(&proposal, min_size) {
                    boxes.push(proposal);
                    scores.push(level_logits[idx]);
                    levels.push(level);
                }
            }
            start += level_anchors.len();
        }
        let threshold = self.config.nms_threshold as f32;
        let mut kept = sdg_kernels::batched_nms(&boxes, &scores, &levels, threshold);
        kept.truncate(post_nms);
        Proposals {
            boxes: kept.iter().map(|i| boxes[*i]).collect(),
            objectness_logits: kept.iter().map(|i| scores[*i]).collect(),
        }
    }

    /// Returns the losses on objectness and deltas.
    ///
    /// `gt_boxes` of each image are in pixels of the resized image; `rngs` has one generator per image, for sampling
    /// its anchors.
    pub fn losses(
        &self,
        predictions: RpnPredictions,
        gt_boxes: &[Vec<Corners>],
        rngs: &mut [Pcg64Mcg],
    ) -> [Tensor<1>; 2] {
        let [num_images, num_anchors] = predictions.objectness_logits.dims();
        let device = predictions.objectness_logits.device();
        let anchors: Vec<Corners> = predictions.anchors.concat();
        let coder = BoxCoder::new(&self.config.box_coder);
        let (mut sampled_idxs, mut objectness_targets) = (Vec::new(), Vec::new());
        let (mut positive_idxs, mut delta_targets) = (Vec::new(), Vec::new());
        for (image_idx, (gt, rng)) in gt_boxes.iter().zip(rngs).enumerate() {
            let matches = match_boxes(&anchors, gt, &self.config.matcher);
            let sampled = sample(&matches, &self.config.sampler, rng);
            let offset = image_idx * num_anchors;
            for idx in &sampled.positive {
                if let Match::Positive(gt_idx) = matches[*idx] {
                    positive_idxs.push((offset + idx) as i32);
                    delta_targets.push(coder.encode(&anchors[*idx], &gt[gt_idx]));
                }
            }
            for (idxs, target) in [(&sampled.positive, 1.0), (&sampled.negative, 0.0)] {
                sampled_idxs.extend(idxs.iter().map(|idx| (offset + idx) as i32));
                objectness_targets.resize(sampled_idxs.len(), target);
            }
        }
        let divisor = match self.config.normaliser {
            RpnNormaliser::NominalSamples => self.config.sampler.batch_size_per_image * num_images,
            RpnNormaliser::DrawnSamples => sampled_idxs.len().max(1),
        } as f64;
        let idxs = Tensor::<1, Int>::from_ints(sampled_idxs.as_slice(), &device);
        let logits = predictions.objectness_logits.reshape([num_images * num_anchors]).select(0, idxs);
        let cls = losses::binary_cross_entropy(logits, &objectness_targets) / divisor;
        if positive_idxs.is_empty() {
            return [cls, Tensor::zeros([1], &device)];
        }
        let idxs = Tensor::<1, Int>::from_ints(positive_idxs.as_slice(), &device);
        let deltas = predictions.deltas.reshape([num_images * num_anchors, 4]).select(0, idxs);
        let loc = losses::regression(deltas, &delta_targets, self.config.regression_loss) / divisor;
        [cls, loc]
    }
}

/// Indices of the `k` largest values, largest first; NaN is skipped; equal values keep their order.
fn top_k(values: &[f32], k: usize) -> Vec<usize> {
    let mut order: Vec<usize> = (0..values.len()).filter(|i| !values[*i].is_nan()).collect();
    let by_value = |a: &usize, b: &usize| values[*b].total_cmp(&values[*a]).then(a.cmp(b));
    if order.len() > k && k > 0 {
        order.select_nth_unstable_by(k - 1, by_value);
    }
    order.truncate(k);
    order.sort_unstable_by(by_value);
    order
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn top_k_orders_and_skips_nan() {
        assert_eq!(top_k(&[1.0, f32::NAN, 3.0, 2.0, 3.0], 3), [2, 4, 3]);
        assert_eq!(top_k(&[1.0, 2.0], 9), [1, 0]);
        assert_eq!(top_k(&[], 3), [0usize; 0]);
    }
}
