//! The network during pretraining: preset `edge` with every head, identifying parts by other views of them.
//!
//! ```text
//! images [N, 3, H, W] ─ backbone, FPN ─ RPN: is there any part ─ ROIs ─┬─ box head ─ hidden ─ one box for all parts
//!                                                                      │     └ mean per part over the other images
//!                                                                      │        ─ imprint ─ which of the step's parts is it
//!                                                                      ├─ keypoint head ─ map
//!                                                                      │     └ sampled at the keypoints in the other images
//!                                                                      │        ─ imprint ─ where the keypoints are in this image
//!                                                                      └─ mask head: pixels of the part
//! ```
//!
//! Shapes: N images, R ROIs, P parts of a step, F hidden width, C channels, S side of a map, K keypoints. No parameter
//! belongs to one part: the network learns features by which views of an unseen part can be told from other parts, as
//! teaching needs. See [`sdg_detection::imprint`].

use burn::module::Module;
use burn::tensor::{Device, Tensor, TensorData};
use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;
use sdg_demonstration::NUM_KEYPOINTS;
use sdg_detection::ResizedTarget;
use sdg_detection::config::{BoxDeltas, RcnnConfig};
use sdg_detection::image_transform::pad_batch;
use sdg_detection::imprint::{Imprint, reading_weights};
use sdg_detection::presets::{RcnnKind, edge_of};
use sdg_detection::roi_heads::heatmap::encode;
use sdg_detection::roi_heads::roi::{RoiClass, SampledRoi};
use sdg_detection::roi_pooler::Roi;
use sdg_detection::rpn::{ImageSize, Mode};
use sdg_detection::sampler::draw;
use sdg_detection::{DetectionError, GeneralizedRcnn, Losses, TransformedImage, losses};
use sdg_layers::initialization::Initializer;
use sdg_layers::upsample_bilinear_2x;

/// Maximum number of ROIs of an image that go through the keypoint head, and through the mask head.
const MAX_ROIS_PER_IMAGE: usize = 6;

/// The network that is pretrained, with every head that teaching uses.
pub fn pretrain_config() -> RcnnConfig {
    let mut config = edge_of(RcnnKind::Keypoint { num_keypoints: NUM_KEYPOINTS });
    config.roi_heads.mask_head = edge_of(RcnnKind::Mask { num_classes: 1 }).roi_heads.mask_head;
    // The layer for one box of all parts has the same shape as the layer for one part, with which teaching continues.
    config.roi_heads.box_head.box_deltas = BoxDeltas::ClassAgnostic;
    // Pictures show several parts: up to half of the ROIs may be on parts.
    config.roi_heads.sampler.positive_fraction = 0.5;
    config
}

/// The network that is pretrained.
#[derive(Module, Debug)]
pub struct PretrainNetwork {
    /// Trunk and heads. The class scores are not used.
    pub detector: GeneralizedRcnn,
    /// Computes the last layers from features of other views.
    pub imprint: Imprint,
}

impl PretrainNetwork {
    /// Initialises the parameters at random.
    ///
    /// # Errors
    /// A configuration that contradicts itself.
    pub fn init(config: &RcnnConfig, device: &Device, seed: u64) -> Result<Self, DetectionError> {
        let detector = config.init(device, seed)?;
        let channels = config.roi_heads.keypoint_head.as_ref().and_then(|head| head.conv_channels.last().copied());
        let mut init = Initializer::new(device, seed ^ 0x6b65_7970_6f69_6e74);
        let imprint = Imprint::init(config.roi_heads.box_head.fc_channels, channels.unwrap_or(1), &mut init);
        Ok(Self { detector, imprint })
    }

    /// Computes the losses of a batch. Targets are in pixels of the images; their labels identify the parts. `seed`
    /// determines the sampled ROIs.
    pub fn losses(&self, images: &[TransformedImage], targets: &[ResizedTarget], seed: u64) -> Losses {
        let stream = |purpose: u128| -> Vec<Pcg64Mcg> {
            let state = |idx: usize| purpose << 64 | u128::from(seed.wrapping_add((idx as u64) << 40));
            (0..images.len()).map(|idx| Pcg64Mcg::from_seed((state(idx) << 1 | 1).to_le_bytes())).collect()
        };
        let detector = &self.detector;
        let padded = pad_batch(images, detector.config().input.size_divisibility);
        let [_, _, height, width] = padded.dims;
        let data = TensorData::new(padded.pixels, padded.dims);
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
        let of_any_part: Vec<SampledRoi> = rois.iter().map(any_part).collect();
        let [_, box_reg] = heads.box_predictor.losses(hidden.clone(), &of_any_part, targets);
        let cls = self.class_loss(&hidden, &rois);
        let chosen = choose(&rois, images.len(), &mut stream(3));
        let keypoint = self.keypoint_loss(&features, &chosen, targets);
        let mask = match &heads.mask_head {
            Some(head) if !chosen.is_empty() => {
                let rois: Vec<SampledRoi> = chosen.iter().map(Chosen::of_any_part).collect();
                head.loss(&features, &rois, targets, &sizes)
            }
            _ => Tensor::zeros([1], &features[0].device()),
        };
        Losses { rpn_cls, rpn_loc, cls, box_reg, keypoint: Some(keypoint), mask: Some(mask) }
    }

    /// Loss of the classification of ROIs by the mean of each part's ROIs in the other images: the cross-entropy over
    /// the parts and the background, plus a binary cross-entropy for every part on its own, because teaching knows one
    /// part only.
    ///
    /// # Shapes
    /// - `hidden`: `[R, F]`
    fn class_loss(&self, hidden: &Tensor<2>, rois: &[SampledRoi]) -> Tensor<1> {
        let part_of = |sampled: &SampledRoi| match sampled.class {
            RoiClass::Object { class_idx, .. } => Some(class_idx),
            RoiClass::Background => None,
        };
        let device = hidden.device();
        let num_parts = rois.iter().filter_map(part_of).max().map_or(0, |last| last + 1);
        let mut sum = Tensor::zeros([1], &device);
        let (mut num_rows, mut num_pairs) = (0, 0.0);
        let mut start = 0;
        for of_image in rois.chunk_by(|a, b| a.roi.image_idx == b.roi.image_idx) {
            let rows = start..start + of_image.len();
            start = rows.end;
            // Rows of other images by part; parts that no other image shows are left out.
            let mut views: Vec<Vec<usize>> = vec![Vec::new(); num_parts];
            for (row, sampled) in rois.iter().enumerate().filter(|(row, _)| !rows.contains(row)) {
                if let Some(part) = part_of(sampled) {
                    views[part].push(row);
                }
            }
            let known: Vec<usize> = (0..num_parts).filter(|part| !views[*part].is_empty()).collect();
            if known.is_empty() {
                continue;
            }
            let mut means = vec![0f32; known.len() * rois.len()];
            for (part, of_part) in known.iter().zip(means.chunks_exact_mut(rois.len())) {
                let share = 1.0 / views[*part].len() as f32;
                views[*part].iter().for_each(|row| of_part[*row] = share);
            }
            let means = Tensor::<2>::from_data(TensorData::new(means, [known.len(), rois.len()]), &device);
            let (weights, biases) = self.imprint.class.classifier(means.matmul(hidden.clone()));
            let of_rows = hidden.clone().slice(rows.clone());
            let scores = of_rows.matmul(weights.transpose()) + biases.unsqueeze();

            let columns: Vec<Option<usize>> = of_image
                .iter()
                .map(|sampled| match part_of(sampled) {
                    Some(part) => known.iter().position(|one| *one == part),
                    None => Some(known.len()),
                })
                .collect();
            num_rows += columns.iter().flatten().count();
            let background = Tensor::zeros([rows.len(), 1], &device);
            sum = sum + losses::cross_entropy(Tensor::cat(vec![scores.clone(), background], 1), &columns);

            let (mut is_part, mut pair_weights) = (Vec::new(), Vec::new());
            for column in &columns {
                for idx in 0..known.len() {
                    is_part.push(if *column == Some(idx) { 1.0 } else { 0.0 });
                    pair_weights.push(match column {
                        None => 0.0,
                        Some(own) if *own == idx => 1.0,
                        Some(_) => 1.0 / known.len() as f32,
                    });
                }
            }
            num_pairs += pair_weights.iter().map(|weight| f64::from(*weight)).sum::<f64>();
            let flat = scores.reshape([rows.len() * known.len()]);
            sum = sum + losses::weighted_binary_cross_entropy(flat, &is_part, &pair_weights);
        }
        sum * (2.0 / (num_rows as f64 + num_pairs).max(1.0))
    }

    /// Loss of the keypoint positions, which are predicted from their part's ROIs in the other images: the sum of
    /// cross-entropies over the cells, divided by the number of keypoints that have a cell.
    fn keypoint_loss(&self, features: &[Tensor<4>; 5], chosen: &[Chosen], targets: &[ResizedTarget]) -> Tensor<1> {
        let zero = || Tensor::zeros([1], &features[0].device());
        let (Some(head), Some(config)) =
            (&self.detector.roi_heads.keypoint_head, &self.detector.config().roi_heads.keypoint_head)
        else {
            return zero();
        };
        let (size, side) = (config.heatmap_size(), config.pooler.output_size);
        let keypoints = |chosen: &Chosen| &targets[chosen.roi.image_idx].keypoints[chosen.gt_idx];
        let chosen: Vec<&Chosen> =
            chosen.iter().filter(|chosen| keypoints(chosen).iter().any(|keypoint| keypoint.is_labelled())).collect();
        let count = chosen.len();
        if count == 0 {
            return zero();
        }
        let boxes: Vec<Roi> = chosen.iter().map(|chosen| chosen.roi).collect();
        let hidden = head.hidden(features, &boxes);
        let [_, channels, _, _] = hidden.dims();
        let flat: Tensor<3> = hidden.clone().reshape([count, channels, side * side]);

        // [R, K, S·S] samples each ROI at its keypoints; [K, R, R] averages over the other images' ROIs of the part.
        let mut readings = vec![0f32; count * NUM_KEYPOINTS * side * side];
        let mut is_read = vec![[false; NUM_KEYPOINTS]; count];
        for (row, of_roi) in readings.chunks_exact_mut(NUM_KEYPOINTS * side * side).enumerate() {
            for (k, (keypoint, of_keypoint)) in
                keypoints(chosen[row]).iter().zip(of_roi.chunks_exact_mut(side * side)).enumerate()
            {
                if let Some(weights) = reading_weights(keypoint, &chosen[row].roi.corners, side) {
                    is_read[row][k] = true;
                    weights.iter().for_each(|(cell, weight)| of_keypoint[*cell] += weight);
                }
            }
        }
        let mut means = vec![0f32; NUM_KEYPOINTS * count * count];
        let mut cells = vec![None; count * NUM_KEYPOINTS];
        for (row, asked) in chosen.iter().enumerate() {
            for k in 0..NUM_KEYPOINTS {
                let is_view = |other: usize| {
                    let view = chosen[other];
                    view.part_idx == asked.part_idx && view.roi.image_idx != asked.roi.image_idx && is_read[other][k]
                };
                let views: Vec<usize> = (0..count).filter(|other| is_view(*other)).collect();
                if views.is_empty() {
                    continue;
                }
                let share = 1.0 / views.len() as f32;
                views.iter().for_each(|other| means[(k * count + row) * count + other] = share);
                cells[row * NUM_KEYPOINTS + k] = encode(&keypoints(asked)[k], &asked.roi.corners, size);
            }
        }
        let num_cells = cells.iter().flatten().count();
        if num_cells == 0 {
            return zero();
        }
        let device = flat.device();
        let readings = TensorData::new(readings, [count, NUM_KEYPOINTS, side * side]);
        let read: Tensor<3> = Tensor::<3>::from_data(readings, &device).matmul(flat.clone().swap_dims(1, 2));
        let means = Tensor::<3>::from_data(TensorData::new(means, [NUM_KEYPOINTS, count, count]), &device);
        let descriptors = means.matmul(read.swap_dims(0, 1)).swap_dims(0, 1);
        let weights = self.imprint.keypoint.weights(descriptors.reshape([count * NUM_KEYPOINTS, channels]));
        let own: Tensor<3> = weights.reshape([count, NUM_KEYPOINTS, channels]).matmul(flat);
        let own = upsample_bilinear_2x(own.reshape([count, NUM_KEYPOINTS, side, side]));
        let logits = upsample_bilinear_2x(head.score_lowres.forward(hidden) + own);
        let sum = losses::cross_entropy(logits.reshape([count * NUM_KEYPOINTS, size * size]), &cells);
        sum * (config.loss_weight / num_cells as f64)
    }
}

/// The ROI, with the first class if it is on a part.
fn any_part(sampled: &SampledRoi) -> SampledRoi {
    let class = match sampled.class {
        RoiClass::Object { gt_idx, .. } => RoiClass::Object { class_idx: 0, gt_idx },
        RoiClass::Background => RoiClass::Background,
    };
    SampledRoi { roi: sampled.roi, class }
}

/// A sampled ROI on a part.
#[derive(Debug, Clone, Copy)]
struct Chosen {
    roi: Roi,
    part_idx: usize,
    gt_idx: usize,
}

impl Chosen {
    fn of_any_part(&self) -> SampledRoi {
        SampledRoi { roi: self.roi, class: RoiClass::Object { class_idx: 0, gt_idx: self.gt_idx } }
    }
}

/// Samples ROIs on parts, at most [`MAX_ROIS_PER_IMAGE`] per image.
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
    chosen
}
