//! The network while it is pretrained: the trunk and heads of preset `edge`, with classes and keypoints for many parts.
//!
//! ```text
//! images [N, 3, H, W] ─ backbone, FPN ─ RPN: is there any part ─ ROIs ─┬─ box head: which of the K parts, one box
//!                                                                      ├─ keypoint head: maps of any part + of that part
//!                                                                      └─ mask head: what the part covers
//! ```
//!
//! Shapes: N images, R ROIs, K parts, S side of a heatmap. Only the last layers know one part from another: the K + 1 class
//! scores, and for each part's keypoints a transposed convolution that is added to the one for all parts. All else is what
//! teaching starts from.

use burn::module::Module;
use burn::tensor::{Device, Tensor};
use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;
use sdg_demonstration::NUM_KEYPOINTS;
use sdg_detection::ResizedTarget;
use sdg_detection::config::{BoxDeltas, RcnnConfig};
use sdg_detection::image_transform::pad_batch;
use sdg_detection::initialization::{Distribution, Initializer};
use sdg_detection::layers::{ConvTranspose2x, upsample_bilinear_2x};
use sdg_detection::presets::{RcnnKind, edge_of};
use sdg_detection::roi_heads::heatmap::encode;
use sdg_detection::roi_heads::roi::{RoiClass, SampledRoi};
use sdg_detection::roi_pooler::{Roi, pool};
use sdg_detection::rpn::{ImageSize, Mode};
use sdg_detection::sampler::draw;
use sdg_detection::{DetectionError, GeneralizedRcnn, Losses, TransformedImage, losses};

/// ROIs of an image that go through the keypoint head, and as many through the mask head.
const MAX_ROIS_PER_IMAGE: usize = 5;

/// The detector that is pretrained: preset `edge` with every head, for so many parts.
pub fn pretrain_config(num_parts: usize) -> RcnnConfig {
    let mut config = one_part_config();
    config.roi_heads.num_classes = num_parts;
    // One box for all parts has the shape of the box of one part, which teaching goes on with.
    config.roi_heads.box_head.box_deltas = BoxDeltas::ClassAgnostic;
    // Pictures show several parts: half of the ROIs may lie on one.
    config.roi_heads.sampler.positive_fraction = 0.5;
    config
}

/// The network that teaching has, with every head.
pub fn one_part_config() -> RcnnConfig {
    let mut config = edge_of(RcnnKind::Keypoint { num_keypoints: NUM_KEYPOINTS });
    config.roi_heads.mask_head = edge_of(RcnnKind::Mask { num_classes: 1 }).roi_heads.mask_head;
    config
}

/// The network that is pretrained.
#[derive(Module, Debug)]
pub struct PretrainNetwork {
    /// Trunk and heads.
    pub detector: GeneralizedRcnn,
    /// What each part adds to the last layer of the keypoint head.
    pub keypoint_maps: Vec<ConvTranspose2x>,
}

impl PretrainNetwork {
    /// Draws the parameters.
    ///
    /// # Errors
    /// A configuration that contradicts itself.
    pub fn init(config: &RcnnConfig, device: &Device, seed: u64) -> Result<Self, DetectionError> {
        let detector = config.init(device, seed)?;
        let mut init = Initializer::new(device, seed ^ 0x6b65_7970_6f69_6e74);
        let channels = config.roi_heads.keypoint_head.as_ref().and_then(|head| head.conv_channels.last().copied());
        // Zero: every part starts from what holds for all of them.
        let mut zeros = |channels| {
            let (weight, bias) = ([channels, NUM_KEYPOINTS, 4, 4], [NUM_KEYPOINTS]);
            let zero = Distribution::Constant(0.0);
            ConvTranspose2x { weight: init.param(weight, zero), bias: init.param(bias, zero) }
        };
        let keypoint_maps =
            std::iter::repeat_n(channels.unwrap_or(1), config.roi_heads.num_classes).map(&mut zeros).collect();
        Ok(Self { detector, keypoint_maps })
    }

    /// Gives the losses of a batch whose targets are in pixels of the images. `seed` draws what takes part in them.
    pub fn losses(&self, images: &[TransformedImage], targets: &[ResizedTarget], seed: u64) -> Losses {
        let stream = |purpose: u128| -> Vec<Pcg64Mcg> {
            let state = |idx: usize| purpose << 64 | u128::from(seed.wrapping_add((idx as u64) << 40));
            (0..images.len()).map(|idx| Pcg64Mcg::from_seed((state(idx) << 1 | 1).to_le_bytes())).collect()
        };
        let detector = &self.detector;
        let padded = pad_batch(images, detector.config().input.size_divisibility);
        let [_, _, height, width] = padded.dims;
        let data = burn::tensor::TensorData::new(padded.pixels, padded.dims);
        let features = detector.backbone.forward(Tensor::from_data(data, &detector.device()));
        let sizes: Vec<ImageSize> = images.iter().map(|image| [image.height, image.width]).collect();

        let rpn = &detector.proposal_generator;
        let predictions = rpn.predict(&features, [height, width]);
        let proposals = rpn.propose(&predictions, &sizes, Mode::Train);
        let gt_boxes: Vec<_> = targets.iter().map(|target| target.boxes.clone()).collect();
        let [rpn_cls, rpn_loc] = rpn.losses(predictions, &gt_boxes, &mut stream(1));

        let heads = &detector.roi_heads;
        let rois = heads.sample_rois(&proposals, targets, &mut stream(2));
        let boxes: Vec<Roi> = rois.iter().map(|sampled| sampled.roi).collect();
        let hidden = heads.box_head.forward(&features, &boxes);
        let [cls, box_reg] = heads.box_predictor.losses(hidden, &rois, targets);
        let chosen = choose(&rois, images.len(), &mut stream(3));
        let keypoint = self.keypoint_loss(&features, &chosen, targets);
        let mask = self.mask_loss(&features, &chosen, targets, &sizes);
        Losses { rpn_cls, rpn_loc, cls, box_reg, keypoint: Some(keypoint), mask: Some(mask) }
    }

    /// The cross-entropy over the cells of each part's own maps, divided by the keypoints that have a cell.
    fn keypoint_loss(&self, features: &[Tensor<4>; 5], chosen: &[Chosen], targets: &[ResizedTarget]) -> Tensor<1> {
        let zero = || Tensor::zeros([1], &features[0].device());
        let (Some(head), Some(config)) =
            (&self.detector.roi_heads.keypoint_head, &self.detector.config().roi_heads.keypoint_head)
        else {
            return zero();
        };
        let size = config.heatmap_size();
        let cells_of = |chosen: &Chosen| -> Vec<Option<usize>> {
            let keypoints = &targets[chosen.roi.image_idx].keypoints[chosen.gt_idx];
            keypoints.iter().map(|keypoint| encode(keypoint, &chosen.roi.corners, size)).collect()
        };
        let with_cells: Vec<(&Chosen, Vec<Option<usize>>)> = chosen
            .iter()
            .map(|chosen| (chosen, cells_of(chosen)))
            .filter(|(_, cells)| cells.iter().any(Option::is_some))
            .collect();
        let count = with_cells.iter().flat_map(|(_, cells)| cells.iter().flatten()).count();
        if count == 0 {
            return zero();
        }
        let boxes: Vec<Roi> = with_cells.iter().map(|(chosen, _)| chosen.roi).collect();
        let pooled = pool(features, &boxes, &config.pooler);
        let hidden = head.conv_fcn.iter().fold(pooled, |x, conv| conv.forward_relu(x));
        let of_any_part = head.score_lowres.forward(hidden.clone());
        let mut sum = zero();
        let mut start = 0;
        // The ROIs of a part stand side by side.
        for of_part in with_cells.chunk_by(|(a, _), (b, _)| a.part_idx == b.part_idx) {
            let rows = |maps: &Tensor<4>| maps.clone().narrow(0, start, of_part.len());
            let own = self.keypoint_maps[of_part[0].0.part_idx].forward(rows(&hidden));
            let logits = upsample_bilinear_2x(rows(&of_any_part) + own);
            start += of_part.len();
            let [r, k, _, _] = logits.dims();
            let cells: Vec<Option<usize>> = of_part.iter().flat_map(|(_, cells)| cells.iter().copied()).collect();
            sum = sum + losses::cross_entropy(logits.reshape([r * k, size * size]), &cells);
        }
        sum * (config.loss_weight / count as f64)
    }

    /// The mask head's loss with the map of the first class for every part.
    fn mask_loss(
        &self,
        features: &[Tensor<4>; 5],
        chosen: &[Chosen],
        targets: &[ResizedTarget],
        sizes: &[ImageSize],
    ) -> Tensor<1> {
        match &self.detector.roi_heads.mask_head {
            Some(head) if !chosen.is_empty() => {
                let of_any_part = |chosen: &Chosen| SampledRoi {
                    roi: chosen.roi,
                    class: RoiClass::Object { class_idx: 0, gt_idx: chosen.gt_idx },
                };
                let rois: Vec<SampledRoi> = chosen.iter().map(of_any_part).collect();
                head.loss(features, &rois, targets, sizes)
            }
            _ => Tensor::zeros([1], &features[0].device()),
        }
    }
}

/// An ROI on a part.
#[derive(Debug, Clone, Copy)]
struct Chosen {
    roi: Roi,
    part_idx: usize,
    gt_idx: usize,
}

/// ROIs on parts, at most [`MAX_ROIS_PER_IMAGE`] an image, in the order of the parts.
fn choose(rois: &[SampledRoi], num_images: usize, rngs: &mut [Pcg64Mcg]) -> Vec<Chosen> {
    let on_part = |sampled: &SampledRoi| match sampled.class {
        RoiClass::Object { class_idx, gt_idx } => Some(Chosen { roi: sampled.roi, part_idx: class_idx, gt_idx }),
        RoiClass::Background => None,
    };
    let mut chosen = Vec::new();
    for (image_idx, rng) in (0..num_images).zip(rngs) {
        let of_image: Vec<Chosen> =
            rois.iter().filter(|sampled| sampled.roi.image_idx == image_idx).filter_map(on_part).collect();
        let mut idxs: Vec<usize> = (0..of_image.len()).collect();
        draw(&mut idxs, MAX_ROIS_PER_IMAGE, rng);
        chosen.extend(idxs.into_iter().map(|idx| of_image[idx]));
    }
    chosen.sort_by_key(|chosen| chosen.part_idx);
    chosen
}
