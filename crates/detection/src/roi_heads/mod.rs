//! The second stage: computes the class of each proposal, and its exact box.
//!
//! ```text
//! proposals ─ sample (training) ─ box_head ─┬─ losses             (training)
//!                                           └─ detections ─ NMS   (inference)
//!        positive proposals / detections ─┬─ keypoint_head ─ losses / keypoints
//!                                         └─ mask_head ─ losses / masks
//! ```

pub mod box_head;
mod head_convs;
pub mod heatmap;
pub mod keypoint_head;
pub mod mask_head;
pub mod mask_paste;
pub mod mask_target;
pub mod roi;

use burn::module::Module;
use burn::tensor::Tensor;
use rand_pcg::Pcg64Mcg;
use sdg_geometry::Keypoint;

use crate::boxes::Corners;
use crate::config::{FpnConfig, RoiHeadsConfig};
use crate::matcher::{Match, match_boxes};
use crate::roi_pooler::Roi;
use crate::rpn::{ImageSize, Proposals};
use crate::sampler::{draw, sample_with_first};
use crate::target::ResizedTarget;
use sdg_layers::Initializer;

use box_head::{BoxHead, BoxPredictor};
use keypoint_head::KeypointHead;
use mask_head::MaskHead;
use roi::{RoiClass, SampledRoi};

pub use roi::RoiDetection;

/// The second stage.
#[derive(Module, Debug)]
pub struct RoiHeads {
    /// Two fully connected layers.
    pub box_head: BoxHead,
    /// Computes classes and box deltas from the box head's features.
    pub box_predictor: BoxPredictor,
    /// Head for keypoints, if the model has one.
    pub keypoint_head: Option<KeypointHead>,
    /// Head for masks, if the model has one.
    pub mask_head: Option<MaskHead>,
    #[module(skip)]
    config: RoiHeadsConfig,
}

/// Losses of the second stage.
#[derive(Debug, Clone)]
pub struct RoiLosses {
    /// Loss of the classes.
    pub cls: Tensor<1>,
    /// Loss of the box deltas.
    pub box_reg: Tensor<1>,
    /// Loss of the heatmaps.
    pub keypoint: Option<Tensor<1>>,
    /// Loss of the masks.
    pub mask: Option<Tensor<1>>,
}

impl RoiHeads {
    /// Initialises the parameters at random.
    pub fn init(config: &RoiHeadsConfig, fpn: &FpnConfig, init: &mut Initializer) -> Self {
        Self {
            box_head: BoxHead::init(&config.box_head, fpn.channels, init),
            box_predictor: BoxPredictor::init(&config.box_head, config.num_classes, init),
            keypoint_head: config.keypoint_head.as_ref().map(|head| KeypointHead::init(head, fpn.channels, init)),
            mask_head: config.mask_head.as_ref().map(|head| {
                let (classes, background) = (config.num_classes, config.box_head.background);
                MaskHead::init(head, fpn.channels, classes, background, init)
            }),
            config: config.clone(),
        }
    }

    /// Matches proposals and objects, and samples the proposals of the losses.
    ///
    /// The objects' own boxes are among the candidates, so there are positives from the start.
    pub fn sample_rois(
        &self,
        proposals: &[Proposals],
        targets: &[ResizedTarget],
        rngs: &mut [Pcg64Mcg],
    ) -> Vec<SampledRoi> {
        let mut rois = Vec::new();
        for (image_idx, ((proposals, target), rng)) in proposals.iter().zip(targets).zip(rngs).enumerate() {
            let candidates: Vec<Corners> = proposals.boxes.iter().chain(&target.boxes).copied().collect();
            let matches = match_boxes(&candidates, &target.boxes, &self.config.matcher);
            let hard_share = self.config.hard_negative_share;
            let sampled = sample_with_first(&matches, &self.config.sampler, hard_share, rng);
            rois.extend(sampled.positive.iter().chain(&sampled.negative).map(|idx| SampledRoi {
                roi: Roi { image_idx, corners: candidates[*idx] },
                class: match matches[*idx] {
                    Match::Positive(gt_idx) => RoiClass::Object { class_idx: target.labels[gt_idx], gt_idx },
                    _ => RoiClass::Background,
                },
            }));
        }
        rois
    }

    /// Returns the losses of the sampled proposals.
    ///
    /// `image_sizes` are those of the resized images, without padding.
    pub fn losses(
        &self,
        features: &[Tensor<4>; 5],
        rois: &[SampledRoi],
        targets: &[ResizedTarget],
        image_sizes: &[ImageSize],
        rngs: &mut [Pcg64Mcg],
    ) -> RoiLosses {
        let device = features[0].device();
        let zero = || Tensor::zeros([1], &device);
        let [cls, box_reg] = if rois.is_empty() {
            [zero(), zero()]
        } else {
            let boxes: Vec<Roi> = rois.iter().map(|sampled| sampled.roi).collect();
            let hidden = self.box_head.forward(features, &boxes);
            self.box_predictor.losses(hidden, rois, targets)
        };
        let keypoint = self.keypoint_head.as_ref().map(|head| {
            let has_keypoint = |sampled: &SampledRoi, gt_idx: usize| {
                let keypoints = &targets[sampled.roi.image_idx].keypoints[gt_idx];
                keypoints.iter().any(|k| is_inside(k, &sampled.roi.corners))
            };
            let chosen = choose_objects(rois, head.max_train_rois_per_image(), rngs, has_keypoint);
            match chosen.is_empty() {
                true => zero(),
                false => head.loss(features, &chosen, targets),
            }
        });
        let mask = self.mask_head.as_ref().map(|head| {
            let chosen = choose_objects(rois, head.config().max_train_rois_per_image, rngs, |_, _| true);
            match chosen.is_empty() {
                true => zero(),
                false => head.loss(features, &chosen, targets, image_sizes),
            }
        });
        RoiLosses { cls, box_reg, keypoint, mask }
    }

    /// Returns the detections of each image, best first.
    pub async fn detect(
        &self,
        features: &[Tensor<4>; 5],
        proposals: &[Proposals],
        image_sizes: &[ImageSize],
    ) -> Vec<Vec<RoiDetection>> {
        let rois: Vec<Roi> = proposals
            .iter()
            .enumerate()
            .flat_map(|(image_idx, proposals)| {
                proposals.boxes.iter().map(move |corners| Roi { image_idx, corners: *corners })
            })
            .collect();
        if rois.is_empty() {
            return vec![Vec::new(); proposals.len()];
        }
        let hidden = self.box_head.forward(features, &rois);
        let mut detections = self.box_predictor.detect(hidden, &rois, image_sizes).await;
        if let Some(head) = &self.keypoint_head {
            head.read_keypoints(features, &mut detections).await;
        }
        if let Some(head) = &self.mask_head {
            head.read_masks(features, &mut detections).await;
        }
        detections
    }
}

/// Samples proposals on objects for a head in training, at most `max` per image. `fit` decides, from the ROI and the
/// object's index in its image, whether a proposal is suitable.
fn choose_objects(
    rois: &[SampledRoi],
    max: Option<usize>,
    rngs: &mut [Pcg64Mcg],
    fit: impl Fn(&SampledRoi, usize) -> bool,
) -> Vec<SampledRoi> {
    let mut chosen = Vec::new();
    for (image_idx, rng) in rngs.iter_mut().enumerate() {
        let mut idxs: Vec<usize> = (0..rois.len())
            .filter(|idx| {
                let sampled = &rois[*idx];
                let RoiClass::Object { gt_idx, .. } = sampled.class else {
                    return false;
                };
                sampled.roi.image_idx == image_idx && fit(sampled, gt_idx)
            })
            .collect();
        if let Some(max) = max {
            draw(&mut idxs, max, rng);
        }
        chosen.extend(idxs.into_iter().map(|idx| rois[idx]));
    }
    chosen
}

fn is_inside(keypoint: &Keypoint, corners: &Corners) -> bool {
    let (x, y) = (keypoint.x as f32, keypoint.y as f32);
    keypoint.is_labelled() && (corners[0]..=corners[2]).contains(&x) && (corners[1]..=corners[3]).contains(&y)
}
