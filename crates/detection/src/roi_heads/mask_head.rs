//! The mask head: computes the area of a box that its object covers.
//!
//! Shapes: R ROIs, C channels, P side of the pooled square, K maps (one per class), S = 2·P side of a mask.
//!
//! ```text
//! pooled [R, C, P, P] ─ 3×3 convolutions ─ transposed [R, C', S, S] ─ 1×1 [R, K, S, S]
//! ```

use burn::module::Module;
use burn::tensor::{Int, Tensor, activation};
use sdg_layers::{Conv2d, Conv2dShape, ConvTranspose2x, Distribution, Initializer};

use crate::config::{BackgroundClass, MaskBalance, MaskHeadConfig, NormKind};
use crate::host::read;
use crate::losses;
use crate::roi_pooler::{Roi, pool};
use crate::rpn::ImageSize;

use super::head_convs;
use super::mask_paste::BoxMask;
use super::mask_target::encode;
use super::roi::{RoiClass, RoiDetection, SampledRoi};
use crate::target::ResizedTarget;

/// Standard deviation of the predictor's initial weights: small, so that training starts from undecided
/// masks.
const PREDICTOR_STD: f64 = 0.001;

/// Convolutions, a transposed and a 1×1 convolution: mask logits of each class.
#[derive(Module, Debug)]
pub struct MaskHead {
    /// 3×3 convolutions; Detectron2's `mask_fcn1` is number 0.
    pub mask_fcn: Vec<Conv2d>,
    /// Transposed convolution, kernel 2, that doubles the side.
    pub deconv: ConvTranspose2x,
    /// 1×1 to one map per class.
    pub predictor: Conv2d,
    /// Number of maps before the map of class 0: one if the background comes first.
    first_class_map: usize,
    #[module(skip)]
    config: MaskHeadConfig,
}

impl MaskHead {
    /// Initialises the parameters at random, for a pyramid of `channels` channels.
    ///
    /// If the background comes first (torchvision), it also has a map, which is not used.
    pub fn init(
        config: &MaskHeadConfig,
        channels: usize,
        num_classes: usize,
        background: BackgroundClass,
        init: &mut Initializer,
    ) -> Self {
        let mask_fcn = head_convs::init(channels, &config.conv_channels, init);
        let in_channels = config.conv_channels.last().copied().unwrap_or(channels);
        let first_class_map = match background {
            BackgroundClass::First => 1,
            BackgroundClass::Last => 0,
        };
        let normal = Distribution::Normal { std: PREDICTOR_STD };
        Self {
            mask_fcn,
            deconv: ConvTranspose2x::init(in_channels, config.deconv_channels, 2, init),
            predictor: Conv2dShape::new(config.deconv_channels, num_classes + first_class_map, 1).init(
                normal,
                NormKind::Identity,
                init,
            ),
            first_class_map,
            config: config.clone(),
        }
    }

    /// The configuration.
    pub(crate) fn config(&self) -> &MaskHeadConfig {
        &self.config
    }

    /// Returns mask logits `[R, K, S, S]`.
    pub fn forward(&self, features: &[Tensor<4>; 5], rois: &[Roi]) -> Tensor<4> {
        let pooled = pool(features, rois, &self.config.pooler);
        let hidden = self.mask_fcn.iter().fold(pooled, |x, conv| conv.forward_relu(x));
        self.predictor.forward(activation::relu(self.deconv.forward(hidden)))
    }

    /// The logits `[R, S·S]` of the map of each ROI's class.
    fn logits_of_classes(&self, features: &[Tensor<4>; 5], rois: &[Roi], classes: &[usize]) -> Tensor<2> {
        let logits = self.forward(features, rois);
        let [r, k, s, _] = logits.dims();
        let maps: Vec<i32> =
            classes.iter().enumerate().map(|(row, class)| (row * k + self.first_class_map + class) as i32).collect();
        let maps = Tensor::<1, Int>::from_ints(maps.as_slice(), &logits.device());
        logits.reshape([r * k, s * s]).select(0, maps)
    }

    /// Returns the binary cross-entropy of the true class's map, averaged over all cells of all ROIs, with the
    /// configured weights.
    ///
    /// `rois` has at least one ROI, and all are on objects; `image_sizes` are those of the resized images.
    pub fn loss(
        &self,
        features: &[Tensor<4>; 5],
        rois: &[SampledRoi],
        targets: &[ResizedTarget],
        image_sizes: &[ImageSize],
    ) -> Tensor<1> {
        let size = self.config.mask_size();
        let mut wanted = Vec::with_capacity(rois.len() * size * size);
        let mut weights = Vec::with_capacity(rois.len() * size * size);
        let (mut boxes, mut classes) = (Vec::new(), Vec::new());
        for SampledRoi { roi, class } in rois {
            let RoiClass::Object { class_idx, gt_idx } = *class else {
                continue;
            };
            let mask = &targets[roi.image_idx].masks[gt_idx];
            let cells = encode(mask, &roi.corners, image_sizes[roi.image_idx], size, self.config.targets);
            let inside = self.config.balance.weight(cells.iter().sum(), cells.len());
            weights.extend(cells.iter().map(|cell| 1.0 + cell * (inside - 1.0)));
            wanted.extend(cells);
            boxes.push(*roi);
            classes.push(class_idx);
        }
        let count = wanted.len();
        let logits = self.logits_of_classes(features, &boxes, &classes).reshape([count]);
        let loss = match self.config.balance {
            MaskBalance::Cells => losses::binary_cross_entropy(logits, &wanted),
            MaskBalance::ThinParts => losses::weighted_binary_cross_entropy(logits, &wanted, &weights),
        };
        loss * (self.config.loss_weight / count as f64)
    }

    /// Computes the mask of every detection.
    pub async fn read_masks(&self, features: &[Tensor<4>; 5], detections: &mut [Vec<RoiDetection>]) {
        let (mut rois, mut classes) = (Vec::new(), Vec::new());
        for (image_idx, found) in detections.iter().enumerate() {
            rois.extend(found.iter().map(|detection| Roi { image_idx, corners: detection.corners }));
            classes.extend(found.iter().map(|detection| detection.class_idx));
        }
        if rois.is_empty() {
            return;
        }
        let size = self.config.mask_size();
        let logits = read(self.logits_of_classes(features, &rois, &classes)).await;
        for (detection, logits) in detections.iter_mut().flatten().zip(logits.chunks_exact(size * size)) {
            let probabilities = logits.iter().map(|logit| 1.0 / (1.0 + (-logit).exp())).collect();
            detection.mask = Some(BoxMask { size, probabilities });
        }
    }
}
