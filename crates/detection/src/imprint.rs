//! Last layers computed from the features of a few views of a part, before any training on that part.
//!
//! ```text
//! views ─ box head ─ hidden [F] of each ─ mean: prototype p ─ class score  s·(p - m)·h - n·|p - m|² + c·h + b
//!       └ keypoint head ─ map [C, P, P] of each, read at the keypoint ─ mean: descriptor d ─ map  t·(d - e)·f, doubled
//! ```
//!
//! Shapes: F hidden width, C channels, P side of a pooled square, K keypoints, M prototypes. h and f are the classified
//! features; m, n, s, c, b and e, t are learnt in pretraining, for all parts together. Both results are linear in h and
//! f, so they can be written as a row of the box predictor and a kernel of the keypoint head's transposed convolution.
//!
//! # Source
//! Snell, Swersky and Zemel, Prototypical Networks for Few-shot Learning (2017); Qi, Brown and Lowe, Low-Shot Learning
//! with Imprinted Weights (2018).

use burn::module::{Module, Param};
use burn::tensor::{Tensor, TensorData};
use sdg_geometry::Keypoint;

use crate::boxes::Corners;
use crate::error::Result;
use crate::generalized_rcnn::GeneralizedRcnn;
use crate::image_transform::{TransformedImage, pad_batch};
use crate::roi_pooler::Roi;
use crate::target::{ResizedTarget, Target};
use sdg_layers::state_dict::{StateDict, WeightTensor};
use sdg_layers::{Distribution, Initializer};

/// Initial factors of the products of features: small, so that pretraining starts from undecided scores.
const FIRST_SCALE: f64 = 0.05;

/// Computes last layers from features.
#[derive(Module, Debug)]
pub struct Imprint {
    /// Computes rows of the box predictor.
    pub class: ClassImprint,
    /// Computes kernels of the keypoint head.
    pub keypoint: KeypointImprint,
}

impl Imprint {
    /// Initialises the parameters for a box head with `hidden` values and a keypoint head with `channels` channels.
    pub fn init(hidden: usize, channels: usize, init: &mut Initializer) -> Self {
        let class = ClassImprint::init(hidden, init);
        let mut constant = |count: usize, value| init.param([count], Distribution::Constant(value));
        let keypoint = KeypointImprint { mean: constant(channels, 0.0), scale: constant(1, FIRST_SCALE) };
        Self { class, keypoint }
    }
}

/// Computes a row of the box predictor from a prototype.
#[derive(Module, Debug)]
pub struct ClassImprint {
    /// m, `[F]`.
    pub mean: Param<Tensor<1>>,
    /// c, `[F]`: the evidence for any part.
    pub common: Param<Tensor<1>>,
    /// s, `[1]`.
    pub scale: Param<Tensor<1>>,
    /// n, `[1]`.
    pub norm_scale: Param<Tensor<1>>,
    /// b, `[1]`.
    pub bias: Param<Tensor<1>>,
}

impl ClassImprint {
    /// Initialises the parameters for `hidden` values.
    pub fn init(hidden: usize, init: &mut Initializer) -> Self {
        let mut constant = |count: usize, value| init.param([count], Distribution::Constant(value));
        Self {
            mean: constant(hidden, 0.0),
            common: constant(hidden, 0.0),
            scale: constant(1, FIRST_SCALE),
            norm_scale: constant(1, 0.5 * FIRST_SCALE),
            bias: constant(1, 0.0),
        }
    }

    /// Weights `[M, F]` and biases `[M]` of the classes with prototypes `[M, F]`, against a background score of zero.
    pub fn classifier(&self, prototypes: Tensor<2>) -> (Tensor<2>, Tensor<1>) {
        let [m, _] = prototypes.dims();
        let centred = prototypes - self.mean.val().unsqueeze();
        let norms: Tensor<1> = centred.clone().square().sum_dim(1).reshape([m]);
        let weights = centred * self.scale.val().unsqueeze() + self.common.val().unsqueeze();
        (weights, self.bias.val() - norms * self.norm_scale.val())
    }
}

/// Computes a kernel of the keypoint head from a descriptor.
#[derive(Module, Debug)]
pub struct KeypointImprint {
    /// e, `[C]`.
    pub mean: Param<Tensor<1>>,
    /// t, `[1]`.
    pub scale: Param<Tensor<1>>,
}

impl KeypointImprint {
    /// Weights `[M, C]` of the keypoints with descriptors `[M, C]`.
    pub fn weights(&self, descriptors: Tensor<2>) -> Tensor<2> {
        (descriptors - self.mean.val().unsqueeze()) * self.scale.val().unsqueeze()
    }
}

/// Cells of a pooled square of `side` × `side` cells and their weights, for linear interpolation of the square at a
/// keypoint; `None` if the keypoint is unlabelled or outside the box, or the box has no area. Coordinates are in pixels
/// of the resized image.
pub fn reading_weights(keypoint: &Keypoint, corners: &Corners, side: usize) -> Option<[(usize, f32); 4]> {
    let [x1, y1, x2, y2] = corners.map(f64::from);
    let is_inside = (x1..=x2).contains(&keypoint.x) && (y1..=y2).contains(&keypoint.y);
    if !keypoint.is_labelled() || !is_inside || x2 <= x1 || y2 <= y1 {
        return None;
    }
    let along = |value: f64, low: f64, high: f64| {
        let last = (side - 1) as f64;
        let at = ((value - low) / (high - low) * side as f64 - 0.5).clamp(0.0, last);
        let first = at.floor().min((last - 1.0).max(0.0));
        (first as usize, (at - first) as f32)
    };
    let ((column, right), (row, down)) = (along(keypoint.x, x1, x2), along(keypoint.y, y1, y2));
    let cell = |dy: usize, dx: usize| (row + dy).min(side - 1) * side + (column + dx).min(side - 1);
    Some([
        (cell(0, 0), (1.0 - down) * (1.0 - right)),
        (cell(0, 1), (1.0 - down) * right),
        (cell(1, 0), down * (1.0 - right)),
        (cell(1, 1), down * right),
    ])
}

/// Kernel of the transposed convolution that doubles a map by linear interpolation, along one axis.
const DOUBLING: [f32; 4] = [0.25, 0.75, 0.75, 0.25];

/// Number of images evaluated at a time.
const BATCH: usize = 16;

impl Imprint {
    /// Returns the last layers of a detector of one class, by the parameters' names: the class scores, and the kernel
    /// of the keypoint maps, which is the sum of the detector's kernel and the imprinted one. The kernel is left out if
    /// a keypoint is in no view. The first object of each image is a view; without any view the result is empty.
    ///
    /// # Errors
    /// No images, or targets that do not fit them.
    pub fn last_layers(
        &self,
        detector: &GeneralizedRcnn,
        images: &[TransformedImage],
        targets: &[Target],
    ) -> Result<StateDict> {
        let targets = detector.resized_targets(images, targets)?;
        let (mut prototype, mut num_views) = (None, 0);
        let mut descriptors = Descriptors::default();
        for (images, targets) in images.chunks(BATCH).zip(targets.chunks(BATCH)) {
            let shown = |(image_idx, target): (usize, &ResizedTarget)| {
                let (corners, keypoints) = (target.boxes.first()?, target.keypoints.first()?);
                Some((Roi { image_idx, corners: *corners }, keypoints.clone()))
            };
            let (rois, keypoints): (Vec<Roi>, Vec<_>) = targets.iter().enumerate().filter_map(shown).unzip();
            if rois.is_empty() {
                continue;
            }
            let padded = pad_batch(images, detector.config().input.size_divisibility);
            let data = TensorData::new(padded.pixels, padded.dims);
            let features = detector.backbone.forward(Tensor::from_data(data, &detector.device()));
            let hidden = detector.roi_heads.box_head.forward(&features, &rois).sum_dim(0);
            prototype = Some(prototype.map_or(hidden.clone(), |sum| sum + hidden));
            num_views += rois.len();
            if let Some(head) = &detector.roi_heads.keypoint_head {
                descriptors.add(head.hidden(&features, &rois), &rois, &keypoints);
            }
        }
        let mut layers = StateDict::new();
        let Some(sum) = prototype else { return Ok(layers) };
        let (weights, biases) = self.class.classifier(sum / num_views as f64);
        let [weights, biases] = [values(weights), values(biases)];
        let zeros = vec![0.0; weights.len()];
        // The row of the background follows that of the part. Its zeros make the background the reference for all
        // scores.
        let rows = WeightTensor { shape: vec![2, weights.len()], values: [weights, zeros].concat() };
        layers.insert("roi_heads.box_predictor.cls_score.weight".into(), rows);
        let biases = WeightTensor { shape: vec![2], values: vec![biases[0], 0.0] };
        layers.insert("roi_heads.box_predictor.cls_score.bias".into(), biases);
        if let (Some(head), Some(means)) = (&detector.roi_heads.keypoint_head, descriptors.means()) {
            let [num_keypoints, channels] = means.dims();
            let own = values(self.keypoint.weights(means));
            let kernel = head.score_lowres.weight.val();
            let mut shared = values(kernel.reshape([channels * num_keypoints * 16]));
            for (idx, cell) in shared.iter_mut().enumerate() {
                let (tap, pair) = (idx % 16, idx / 16);
                let (channel, keypoint) = (pair / num_keypoints, pair % num_keypoints);
                *cell += own[keypoint * channels + channel] * DOUBLING[tap / 4] * DOUBLING[tap % 4];
            }
            let kernel = WeightTensor { shape: vec![channels, num_keypoints, 4, 4], values: shared };
            layers.insert("roi_heads.keypoint_head.score_lowres.weight".into(), kernel);
        }
        Ok(layers)
    }
}

/// The keypoint head's features at each keypoint, summed over views.
#[derive(Default)]
struct Descriptors {
    /// Sum of the features, `[K, C]`.
    sum: Option<Tensor<2>>,
    /// Number of views of each keypoint.
    counts: Vec<f32>,
}

impl Descriptors {
    /// Adds views from `maps` `[R, C, P, P]`.
    fn add(&mut self, maps: Tensor<4>, rois: &[Roi], keypoints: &[Vec<Keypoint>]) {
        let [count, channels, side, _] = maps.dims();
        let num_keypoints = keypoints.first().map_or(0, Vec::len);
        self.counts.resize(num_keypoints, 0.0);
        let mut readings = vec![0f32; num_keypoints * count * side * side];
        for (row, (roi, keypoints)) in rois.iter().zip(keypoints).enumerate() {
            for (k, keypoint) in keypoints.iter().enumerate() {
                let Some(weights) = reading_weights(keypoint, &roi.corners, side) else { continue };
                self.counts[k] += 1.0;
                let start = (k * count + row) * side * side;
                weights.iter().for_each(|(cell, weight)| readings[start + cell] += weight);
            }
        }
        let readings = TensorData::new(readings, [num_keypoints, count * side * side]);
        let cells: Tensor<2> = maps.permute([0, 2, 3, 1]).reshape([count * side * side, channels]);
        let read = Tensor::<2>::from_data(readings, &cells.device()).matmul(cells);
        self.sum = Some(self.sum.take().map_or(read.clone(), |sum| sum + read));
    }

    /// Mean features `[K, C]`; `None` if a keypoint was in no view.
    fn means(self) -> Option<Tensor<2>> {
        let sum = self.sum.filter(|_| self.counts.iter().all(|count| *count > 0.0))?;
        let counts = Tensor::<1>::from_floats(self.counts.as_slice(), &sum.device()).reshape([self.counts.len(), 1]);
        Some(sum / counts)
    }
}

fn values<const D: usize>(tensor: Tensor<D>) -> Vec<f32> {
    tensor.into_data().iter::<f32>().collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::ResizeRule;
    use crate::presets::edge;
    use crate::roi_heads::heatmap::encode;
    use burn::tensor::Device;
    use image::{Rgb, RgbImage};
    use sdg_geometry::BoundingBox;
    use sdg_layers::state_dict;

    const NUM_KEYPOINTS: usize = 3;

    /// The edge preset, narrow and for small pictures.
    fn detector() -> GeneralizedRcnn {
        let mut config = edge(NUM_KEYPOINTS);
        config.input.resize = ResizeRule::FitWithin { width_px: 96, height_px: 96 };
        (config.backbone.stem_channels, config.backbone.res2_channels) = (8, 8);
        config.backbone.num_blocks = [1, 1, 1, 1];
        config.fpn.channels = 8;
        config.roi_heads.box_head.fc_channels = 16;
        if let Some(head) = &mut config.roi_heads.keypoint_head {
            head.conv_channels = vec![12];
        }
        config.init(&Device::flex(), 4).unwrap()
    }

    fn imprint() -> Imprint {
        let mut init = Initializer::new(&Device::flex(), 6);
        let mut vector = |count| init.param([count], Distribution::Normal { std: 0.3 });
        let class = ClassImprint {
            mean: vector(16),
            common: vector(16),
            scale: vector(1),
            norm_scale: vector(1),
            bias: vector(1),
        };
        Imprint { class, keypoint: KeypointImprint { mean: vector(12), scale: vector(1) } }
    }

    /// Pictures of a bright patch, and one without.
    fn views() -> (Vec<RgbImage>, Vec<Target>) {
        let patch = |x0: u32, y0: u32| {
            RgbImage::from_fn(96, 96, |x, y| {
                let inside = (x0..x0 + 40).contains(&x) && (y0..y0 + 24).contains(&y);
                Rgb([if inside { 150 + (x - x0) as u8 * 2 } else { 30 }, 60, if inside { 90 + y as u8 } else { 50 }])
            })
        };
        let target = |x0: f64, y0: f64| Target {
            boxes: vec![BoundingBox { x1: x0, y1: y0, x2: x0 + 40.0, y2: y0 + 24.0 }],
            labels: vec![0],
            keypoints: vec![
                (0..NUM_KEYPOINTS).map(|k| Keypoint::visible([x0 + 8.0 + 11.0 * k as f64, y0 + 13.0].into())).collect(),
            ],
            masks: Vec::new(),
        };
        let none = Target { boxes: vec![], labels: vec![], keypoints: vec![], masks: vec![] };
        (vec![patch(10, 20), RgbImage::new(96, 96), patch(44, 50)], vec![target(10.0, 20.0), none, target(44.0, 50.0)])
    }

    #[test]
    fn the_layers_are_the_imprints_of_the_mean_view() {
        let (detector, imprint) = (detector(), imprint());
        let (pictures, targets) = views();
        let images: Vec<TransformedImage> =
            pictures.iter().map(|picture| detector.image_transform().apply(picture).unwrap()).collect();
        let layers = imprint.last_layers(&detector, &images, &targets).unwrap();
        let (imprinted, report) = state_dict::import(detector.clone(), &layers);
        assert!(report.mismatched.is_empty() && report.unused.is_empty(), "{report:?}");

        // The scores of the first view are those of the formula.
        let padded = pad_batch(&images, 32);
        let data = TensorData::new(padded.pixels, padded.dims);
        let features = detector.backbone.forward(Tensor::from_data(data, &Device::flex()));
        let rois = [(0, [10.0, 20.0, 50.0, 44.0]), (2, [44.0, 50.0, 84.0, 74.0])]
            .map(|(image_idx, corners)| Roi { image_idx, corners });
        let hidden = detector.roi_heads.box_head.forward(&features, &rois);
        let scores = values(imprinted.roi_heads.box_predictor.cls_score.forward(hidden.clone()));
        let (weights, biases) = imprint.class.classifier(hidden.clone().mean_dim(0));
        let expected = values(hidden.matmul(weights.transpose()) + biases.unsqueeze());
        for row in 0..2 {
            assert!((scores[2 * row] - expected[row]).abs() < 1e-4, "{scores:?} {expected:?}");
            assert_eq!(scores[2 * row + 1], 0.0);
        }

        // The keypoint's kernel adds the product of the descriptor and the map, doubled by linear interpolation, except
        // near the border, where the transposed convolution reads zeros.
        let [head, own_head] = [&detector, &imprinted].map(|d| d.roi_heads.keypoint_head.as_ref().unwrap());
        let maps = head.hidden(&features, &rois);
        let added = own_head.score_lowres.forward(maps.clone()) - head.score_lowres.forward(maps.clone());
        let flat: Tensor<3> = maps.reshape([2, 12, 14 * 14]);
        let mut descriptors = vec![0f32; NUM_KEYPOINTS * 12];
        let cells = values(flat.clone());
        for (row, (roi, target)) in rois.iter().zip([&targets[0], &targets[2]]).enumerate() {
            for (k, keypoint) in target.keypoints[0].iter().enumerate() {
                for (cell, weight) in reading_weights(keypoint, &roi.corners, 14).unwrap() {
                    for channel in 0..12 {
                        descriptors[k * 12 + channel] += 0.5 * weight * cells[(row * 12 + channel) * 196 + cell];
                    }
                }
            }
        }
        let descriptors = Tensor::<2>::from_data(TensorData::new(descriptors, [NUM_KEYPOINTS, 12]), &Device::flex());
        let products = imprint.keypoint.weights(descriptors).unsqueeze::<3>().repeat_dim(0, 2).matmul(flat);
        let doubled = sdg_layers::upsample_bilinear_2x(products.reshape([2, NUM_KEYPOINTS, 14, 14]));
        let (added, doubled) = (values(added), values(doubled));
        for (idx, (one, other)) in added.iter().zip(&doubled).enumerate() {
            let (y, x) = (idx / 28 % 28, idx % 28);
            if (1..27).contains(&x) && (1..27).contains(&y) {
                assert!((one - other).abs() < 1e-3 * (1.0 + other.abs()), "{idx}: {one} {other}");
            }
        }
    }

    #[test]
    fn without_a_view_there_are_no_layers() {
        let detector = detector();
        let (pictures, targets) = views();
        let images = [detector.image_transform().apply(&pictures[1]).unwrap()];
        assert!(imprint().last_layers(&detector, &images, &targets[1..2]).unwrap().is_empty());
    }

    #[test]
    fn a_square_is_read_where_the_keypoint_lies() {
        let corners = [10.0, 20.0, 24.0, 34.0];
        let read = |x: f64, y: f64| reading_weights(&Keypoint::visible([x, y].into()), &corners, 14);
        // At the centre of a cell, only this cell counts; between two cells, both count.
        assert_eq!(read(13.5, 20.5).unwrap()[0], (3, 1.0));
        let [left, right, ..] = read(14.0, 20.5).unwrap();
        assert_eq!((left, right), ((3, 0.5), (4, 0.5)));
        let sum: f32 = read(23.9, 33.9).unwrap().iter().map(|(_, weight)| weight).sum();
        assert!((sum - 1.0).abs() < 1e-6);
        assert!(read(9.0, 25.0).is_none());
        assert!(encode(&Keypoint::visible([9.0, 25.0].into()), &corners, 56).is_none());
    }
}
