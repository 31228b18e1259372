//! The whole detector: transform, backbone, proposals, ROI heads, and the conversion back to the original image.

use burn::module::Module;
use burn::tensor::{Device, Tensor, TensorData, read_sync};
use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;
use sdg_geometry::{BoundingBox, Mask};

use crate::config::{Freeze, MaskHeadConfig, RcnnConfig};
use crate::error::{DetectionError, Result};
use crate::fpn::Fpn;
use crate::image_transform::{ImageTransform, TransformedImage, pad_batch};
use crate::losses::Losses;
use crate::resnet::{ResNet, frozen};
use crate::roi_heads::{RoiDetection, RoiHeads};
use crate::rpn::{ImageSize, Mode, Proposals, RegionProposalNetwork};
use crate::target::ResizedTarget;
use crate::target::Target;
use sdg_layers::Initializer;

/// Residual network and feature pyramid.
#[derive(Module, Debug)]
pub struct Backbone {
    /// The residual network.
    pub bottom_up: ResNet,
    /// 1×1 and 3×3 convolutions of the pyramid.
    pub fpn: Fpn,
}

impl Backbone {
    /// Returns p2 to p6 of a padded batch `[N, 3, H, W]`.
    pub fn forward(&self, images: Tensor<4>) -> [Tensor<4>; 5] {
        self.fpn.forward(self.bottom_up.forward(images))
    }
}

/// A detector of the R-CNN family.
///
/// Paths of the parameters follow Detectron2, with two exceptions: the pyramid's names have the
/// prefix `backbone.fpn.`, and `conv_fcn1`, `mask_fcn1` are called `conv_fcn.0`, `mask_fcn.0`.
#[derive(Module, Debug)]
pub struct GeneralizedRcnn {
    /// Computes feature maps from the image.
    pub backbone: Backbone,
    /// Computes proposals from feature maps.
    pub proposal_generator: RegionProposalNetwork,
    /// Computes detections from proposals.
    pub roi_heads: RoiHeads,
    #[module(skip)]
    config: RcnnConfig,
}

/// A detected keypoint, in pixels of the original image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScoredKeypoint {
    /// Position in pixels, x right.
    pub x: f64,
    /// Position in pixels, y down.
    pub y: f64,
    /// Score; see [`crate::config::KeypointScore`].
    pub score: f64,
}

/// Detections of one image, best first, in pixels of the original image.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Detections {
    /// Boxes, in pixels of the original image.
    pub boxes: Vec<BoundingBox>,
    /// Probability of each box's class.
    pub scores: Vec<f64>,
    /// Class of each box.
    pub classes: Vec<usize>,
    /// Keypoints of each box; empty lists without a keypoint head.
    pub keypoints: Vec<Vec<ScoredKeypoint>>,
    /// Mask of each box, as large as the image; empty without a mask head.
    pub masks: Vec<Mask>,
}

impl RcnnConfig {
    /// Builds the detector with random parameters from a seed.
    ///
    /// For training the device must carry autodiff (`device.autodiff()`, feature `training`).
    ///
    /// # Errors
    /// The errors of [`RcnnConfig::validate`].
    pub fn init(&self, device: &Device, seed: u64) -> Result<GeneralizedRcnn> {
        self.build(Initializer::new(device, seed))
    }

    /// Builds the detector on `device` without initial values, for a caller that then sets all parameters.
    ///
    /// # Errors
    /// The errors of [`RcnnConfig::validate`].
    pub fn init_blank(&self, device: &Device) -> Result<GeneralizedRcnn> {
        self.build(Initializer::blank(device))
    }

    fn build(&self, mut init: Initializer) -> Result<GeneralizedRcnn> {
        self.validate()?;
        let stage_channels = self.backbone.stage_channels();
        let mut backbone = Backbone {
            bottom_up: ResNet::init(&self.backbone, &mut init),
            fpn: Fpn::init(&self.fpn, stage_channels, &mut init),
        };
        let mut proposal_generator =
            RegionProposalNetwork::init(&self.rpn, &self.anchors, self.fpn.channels, &mut init);
        if self.backbone.freeze >= Freeze::FirstStage {
            (backbone, proposal_generator) = (frozen(backbone), frozen(proposal_generator));
        }
        Ok(GeneralizedRcnn {
            backbone,
            proposal_generator,
            roi_heads: RoiHeads::init(&self.roi_heads, &self.fpn, &mut init),
            config: self.clone(),
        })
    }
}

impl GeneralizedRcnn {
    /// The configuration of the detector.
    pub fn config(&self) -> &RcnnConfig {
        &self.config
    }

    /// The transform of images for [`Self::losses`] and [`Self::detect`].
    pub fn image_transform(&self) -> ImageTransform {
        ImageTransform::new(&self.config.input)
    }

    /// The device of the parameters, including autodiff.
    pub fn device(&self) -> Device {
        self.roi_heads.box_head.fc1.weight.val().device()
    }

    /// The padded batch `[N, 3, H, W]` and the sizes of its images without padding.
    pub(crate) fn batch(&self, images: &[TransformedImage]) -> (Tensor<4>, Vec<ImageSize>) {
        let padded = pad_batch(images, self.config.input.size_divisibility);
        let data = TensorData::new(padded.pixels, padded.dims);
        let sizes = images.iter().map(|i| [i.height, i.width]).collect();
        (Tensor::from_data(data, &self.device()), sizes)
    }

    /// Returns the training losses of a batch.
    ///
    /// `seed` determines the sampled anchors and proposals; pass a different seed in each step. Images without objects
    /// are allowed: they teach the background.
    ///
    /// # Errors
    /// No images, different numbers of images and targets, or a target that contradicts itself, its image or the
    /// configuration.
    pub fn losses(&self, images: &[TransformedImage], targets: &[Target], seed: u64) -> Result<Losses> {
        let targets = self.resized_targets(images, targets)?;
        Ok(self.losses_of_resized(images, &targets, seed))
    }

    /// Like [`Self::losses`], with targets in pixels of the resized images and without checks.
    pub(crate) fn losses_of_resized(
        &self,
        images: &[TransformedImage],
        targets: &[ResizedTarget],
        seed: u64,
    ) -> Losses {
        // A random stream for each image and purpose, so that the samples of one image do not affect those of the
        // others.
        let rngs = |purpose: u128| -> Vec<Pcg64Mcg> {
            let state = |idx: usize| purpose << 64 | u128::from(seed.wrapping_add((idx as u64) << 40));
            (0..images.len()).map(|idx| Pcg64Mcg::from_seed((state(idx) << 1 | 1).to_le_bytes())).collect()
        };
        let (tensor, sizes) = self.batch(images);
        let [_, _, height, width] = tensor.dims();
        let features = self.backbone.forward(tensor);
        let predictions = self.proposal_generator.predict(&features, [height, width]);
        let proposals = self.proposal_generator.propose(&predictions, &sizes, Mode::Train);
        let gt_boxes: Vec<_> = targets.iter().map(|target| target.boxes.clone()).collect();
        let [rpn_cls, rpn_loc] = self.proposal_generator.losses(predictions, &gt_boxes, &mut rngs(1));
        let rois = self.roi_heads.sample_rois(&proposals, targets, &mut rngs(2));
        let roi = self.roi_heads.losses(&features, &rois, targets, &sizes, &mut rngs(3));
        Losses { rpn_cls, rpn_loc, cls: roi.cls, box_reg: roi.box_reg, keypoint: roi.keypoint, mask: roi.mask }
    }

    /// Finds the objects in each image.
    ///
    /// On a detector in training, call this method on `valid()`, so that no gradients are recorded.
    pub fn detect(&self, images: &[TransformedImage]) -> Vec<Detections> {
        read_sync(self.detect_async(images))
    }

    /// [`Self::detect`], asynchronous, for browsers, which give access to a graphics card's results only in this way.
    pub async fn detect_async(&self, images: &[TransformedImage]) -> Vec<Detections> {
        if images.is_empty() {
            return Vec::new();
        }
        let (tensor, sizes) = self.batch(images);
        let [_, _, height, width] = tensor.dims();
        let features = self.backbone.forward(tensor);
        let predictions = self.proposal_generator.predict(&features, [height, width]);
        let proposals = self.proposal_generator.propose_async(&predictions, &sizes, Mode::Test).await;
        self.detections(images, &features, &proposals).await
    }

    /// The detections of the second stage, in pixels of the original images.
    pub(crate) async fn detections(
        &self,
        images: &[TransformedImage],
        features: &[Tensor<4>; 5],
        proposals: &[Proposals],
    ) -> Vec<Detections> {
        let sizes: Vec<ImageSize> = images.iter().map(|i| [i.height, i.width]).collect();
        let found = self.roi_heads.detect(features, proposals, &sizes).await;
        let mask_head = self.config.roi_heads.mask_head.as_ref();
        images.iter().zip(found).map(|(image, found)| original_detections(image, &found, mask_head)).collect()
    }

    pub(crate) fn resized_targets(
        &self,
        images: &[TransformedImage],
        targets: &[Target],
    ) -> Result<Vec<ResizedTarget>> {
        if images.is_empty() {
            return Err(DetectionError::EmptyBatch);
        }
        if images.len() != targets.len() {
            return Err(DetectionError::BatchSize { expected: images.len(), found: targets.len() });
        }
        targets
            .iter()
            .enumerate()
            .map(|(image_idx, target)| {
                let (image, heads) = (&images[image_idx], &self.config.roi_heads);
                target.check(image_idx, image, heads)?;
                Ok(target.resized(image, heads))
            })
            .collect()
    }
}

fn original_detections(
    image: &TransformedImage,
    found: &[RoiDetection],
    mask_head: Option<&MaskHeadConfig>,
) -> Detections {
    let [sx, sy] = image.resized_from_original();
    let mut detections = Detections::default();
    for detection in found {
        let original = image.original_box(&detection.corners);
        if original.width() <= 0.0 || original.height() <= 0.0 {
            continue;
        }
        detections.boxes.push(original);
        detections.scores.push(f64::from(detection.score));
        detections.classes.push(detection.class_idx);
        let keypoints = detection.keypoints.iter().map(|keypoint| ScoredKeypoint {
            x: f64::from(keypoint.x) / sx,
            y: f64::from(keypoint.y) / sy,
            score: f64::from(keypoint.score),
        });
        detections.keypoints.push(keypoints.collect());
        if let (Some(mask), Some(head)) = (&detection.mask, mask_head) {
            let (width, height) = (image.original_width as u32, image.original_height as u32);
            detections.masks.push(mask.paste(&original, width, height, head.threshold, head.pasting));
        }
    }
    detections
}
