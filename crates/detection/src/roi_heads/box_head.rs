//! The box head: computes class and box of each proposal.
//!
//! Shapes: R ROIs, C channels, S side of the pooled square, F hidden width, K classes.

use burn::module::Module;
use burn::tensor::{Int, Tensor, activation};
use sdg_kernels::Activation;
use sdg_layers::{Distribution, Initializer, Linear};

use crate::box_coder::BoxCoder;
use crate::boxes::{Corners, clip, is_usable};
use crate::config::{BackgroundClass, BoxDeltas, BoxHeadConfig, RoiPoolerConfig};
use crate::host::read_both;
use crate::losses;
use crate::roi_pooler::{Roi, pool};
use crate::rpn::ImageSize;

use super::roi::{RoiClass, RoiDetection, SampledRoi};
use crate::target::ResizedTarget;

/// Standard deviation of the initial weights of the scores: small, so that training starts from undecided classes.
const SCORE_STD: f64 = 0.01;
/// Standard deviation of the initial weights of the deltas: small, so that training starts from unmoved boxes.
const DELTA_STD: f64 = 0.001;

/// Pooling and two fully connected layers.
#[derive(Module, Debug)]
pub struct BoxHead {
    /// `[F, C·S·S]`.
    pub fc1: Linear,
    /// `[F, F]`.
    pub fc2: Linear,
    #[module(skip)]
    pooler: RoiPoolerConfig,
}

impl BoxHead {
    /// Initialises the parameters at random, for a pyramid of `channels` channels.
    pub fn init(config: &BoxHeadConfig, channels: usize, init: &mut Initializer) -> Self {
        let inputs = channels * config.pooler.output_size.pow(2);
        let hidden = config.fc_channels;
        Self {
            fc1: Linear::init(inputs, hidden, Distribution::lecun_uniform(inputs), init),
            fc2: Linear::init(hidden, hidden, Distribution::lecun_uniform(hidden), init),
            pooler: config.pooler,
        }
    }

    /// Returns the hidden values `[R, F]`.
    pub fn forward(&self, features: &[Tensor<4>; 5], rois: &[Roi]) -> Tensor<2> {
        let hidden = self.fc1.forward_maps(pool(features, rois, &self.pooler), Activation::Relu);
        let [num_rois, width] = hidden.dims();
        self.fc2.forward_maps(hidden.reshape([num_rois, width, 1, 1]), Activation::Relu)
    }
}

/// Number of groups of four box deltas.
fn num_delta_columns(config: &BoxHeadConfig, num_classes: usize) -> usize {
    match (config.box_deltas, config.background) {
        (BoxDeltas::ClassAgnostic, _) => 1,
        (BoxDeltas::ClassSpecific, BackgroundClass::Last) => num_classes,
        (BoxDeltas::ClassSpecific, BackgroundClass::First) => num_classes + 1,
    }
}

/// Class scores and box deltas.
#[derive(Module, Debug)]
pub struct BoxPredictor {
    /// `[K+1, F]`.
    pub cls_score: Linear,
    /// `[4·columns, F]`.
    pub bbox_pred: Linear,
    num_classes: usize,
    #[module(skip)]
    config: BoxHeadConfig,
}

impl BoxPredictor {
    /// Initialises the parameters at random.
    pub fn init(config: &BoxHeadConfig, num_classes: usize, init: &mut Initializer) -> Self {
        let hidden = config.fc_channels;
        let columns = num_delta_columns(config, num_classes);
        let mut linear = |outputs, std| Linear::init(hidden, outputs, Distribution::Normal { std }, init);
        Self {
            cls_score: linear(num_classes + 1, SCORE_STD),
            bbox_pred: linear(4 * columns, DELTA_STD),
            num_classes,
            config: config.clone(),
        }
    }

    fn score_column(&self, class_idx: usize) -> usize {
        match self.config.background {
            BackgroundClass::First => class_idx + 1,
            BackgroundClass::Last => class_idx,
        }
    }

    fn background_column(&self) -> usize {
        match self.config.background {
            BackgroundClass::First => 0,
            BackgroundClass::Last => self.num_classes,
        }
    }

    fn delta_column(&self, class_idx: usize) -> usize {
        match self.config.box_deltas {
            BoxDeltas::ClassAgnostic => 0,
            BoxDeltas::ClassSpecific => self.score_column(class_idx),
        }
    }

    /// Returns the losses on classes and deltas, each divided by the number of sampled ROIs.
    ///
    /// # Shapes
    /// - `hidden`: `[R, F]`
    pub fn losses(&self, hidden: Tensor<2>, rois: &[SampledRoi], targets: &[ResizedTarget]) -> [Tensor<1>; 2] {
        let device = hidden.device();
        let coder = BoxCoder::new(&self.config.box_coder);
        let columns = num_delta_columns(&self.config, self.num_classes);
        let mut classes = Vec::with_capacity(rois.len());
        let (mut delta_rows, mut delta_targets) = (Vec::new(), Vec::new());
        for (row, SampledRoi { roi, class }) in rois.iter().enumerate() {
            match *class {
                RoiClass::Background => classes.push(Some(self.background_column())),
                RoiClass::Object { class_idx, gt_idx } => {
                    classes.push(Some(self.score_column(class_idx)));
                    delta_rows.push((row * columns + self.delta_column(class_idx)) as i32);
                    let gt = &targets[roi.image_idx].boxes[gt_idx];
                    delta_targets.push(coder.encode(&roi.corners, gt));
                }
            }
        }
        let count = rois.len() as f64;
        let cls = losses::cross_entropy(self.cls_score.forward(hidden.clone()), &classes) / count;
        if delta_rows.is_empty() {
            return [cls, Tensor::zeros([1], &device)];
        }
        let delta_rows = Tensor::<1, Int>::from_ints(delta_rows.as_slice(), &device);
        let deltas = self.bbox_pred.forward(hidden).reshape([rois.len() * columns, 4]).select(0, delta_rows);
        let reg = losses::regression(deltas, &delta_targets, self.config.regression_loss) / count;
        [cls, reg]
    }

    /// Returns the detections of each image, best first, without keypoints and masks.
    pub async fn detect(&self, hidden: Tensor<2>, rois: &[Roi], image_sizes: &[ImageSize]) -> Vec<Vec<RoiDetection>> {
        let scores = activation::softmax(self.cls_score.forward(hidden.clone()), 1);
        let [scores, deltas] = read_both(scores, self.bbox_pred.forward(hidden)).await;
        let columns = num_delta_columns(&self.config, self.num_classes);
        let coder = BoxCoder::new(&self.config.box_coder);
        let mut candidates: Vec<(Vec<Corners>, Vec<f32>, Vec<usize>)> = vec![Default::default(); image_sizes.len()];
        for (row, roi) in rois.iter().enumerate() {
            let [height, width] = image_sizes[roi.image_idx];
            let (boxes, kept_scores, classes) = &mut candidates[roi.image_idx];
            for class_idx in 0..self.num_classes {
                let score = scores[row * (self.num_classes + 1) + self.score_column(class_idx)];
                if score.is_nan() || f64::from(score) <= self.config.score_threshold {
                    continue;
                }
                let at = (row * columns + self.delta_column(class_idx)) * 4;
                let delta = [deltas[at], deltas[at + 1], deltas[at + 2], deltas[at + 3]];
                let decoded = coder.decode(&roi.corners, &delta);
                if !is_usable(&decoded, f32::NEG_INFINITY) {
                    continue;
                }
                let clipped = clip(&decoded, width as f32, height as f32);
                if is_usable(&clipped, self.config.min_box_size_px as f32) {
                    boxes.push(clipped);
                    kept_scores.push(score);
                    classes.push(class_idx);
                }
            }
        }
        let threshold = self.config.nms_threshold as f32;
        candidates
            .into_iter()
            .map(|(boxes, scores, classes)| {
                let mut kept = sdg_kernels::batched_nms(&boxes, &scores, &classes, threshold);
                kept.truncate(self.config.detections_per_image);
                kept.into_iter()
                    .map(|idx| RoiDetection {
                        corners: boxes[idx],
                        score: scores[idx],
                        class_idx: classes[idx],
                        keypoints: Vec::new(),
                        mask: None,
                    })
                    .collect()
            })
            .collect()
    }
}
