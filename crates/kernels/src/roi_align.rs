//! ROIAlign: feature maps to crops of one size, by bilinear samples averaged over each bin.
//!
//! Shapes: N images, C channels, maps of H × W, R regions of interest, crops of Ph × Pw bins.
//!
//! Glossary: *ROI*, a box in image pixels with the index of its image; *bin*, one cell of the crop; *grid*,
//! the samples a bin averages along one axis. Bilinear sampling and averaging are separable, so a bin is
//! `Σ_y Σ_x weight_y · weight_x · feature(y, x)`, and [`AxisBins`] holds the weights of one axis.
//!
//! Source: He et al., Mask R-CNN (2017), section 3; the conventions of Detectron2's `ROIAlign` (`aligned`)
//! and torchvision's `roi_align`, which differ by [`RoiAlignment`]. Unlike there, samples are weighed in
//! per-axis order, so the last bits differ; and an ROI with a non-finite corner gives zeros.

use burn::backend::Dispatch;
use burn::tensor::Tensor;

use crate::extension::KernelBackend;

pub(crate) mod kernel;
#[cfg(test)]
mod tests;

/// How many bilinear samples a bin averages along each axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SamplingRatio {
    /// As many as the bin is feature pixels long, rounded up (`sampling_ratio = 0` in Detectron2).
    Adaptive,
    /// Always this many, at least 1.
    Fixed(usize),
}

/// Where a feature pixel's value stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RoiAlignment {
    /// At the pixel's centre: boxes are shifted by half a pixel (Detectron2's `aligned = True`).
    HalfPixel,
    /// At the pixel's corner, and no ROI is smaller than one feature pixel (torchvision's default).
    Legacy,
}

/// Parameters of [`roi_align`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoiAlignParams {
    /// Bins of the crop, `[Ph, Pw]`.
    pub output_size: [usize; 2],
    /// Feature pixels per image pixel, such as 1/16.
    pub spatial_scale: f32,
    /// Samples per bin and axis.
    pub sampling_ratio: SamplingRatio,
    /// Where feature values stand.
    pub alignment: RoiAlignment,
}

/// Crops `features` at `rois` into maps of one size.
///
/// Differentiable with respect to `features`; `rois` are constants.
///
/// # Shapes
/// `features` `[N, C, H, W]`, `rois` `[R, 5]` of `(image index, x1, y1, x2, y2)` in image pixels; the result
/// is `[R, C, Ph, Pw]`. R may be 0.
///
/// # Panics
/// Where the shapes are others, the output size or a fixed sampling ratio is 0, or an image index is no
/// integer in `0..N`.
pub fn roi_align(features: Tensor<4>, rois: Tensor<2>, params: RoiAlignParams) -> Tensor<4> {
    let [num_images, channels, height, width] = features.dims();
    let [num_rois, columns] = rois.dims();
    assert!(columns == 5, "roi_align: expected ROIs of [R, 5] (image index, x1, y1, x2, y2), found {:?}", rois.dims());
    assert!(
        params.output_size.iter().all(|&bins| bins > 0),
        "roi_align: expected at least one bin an axis, found {:?}",
        params.output_size
    );
    assert!(
        params.sampling_ratio != SamplingRatio::Fixed(0),
        "roi_align: expected a sampling ratio of at least 1, found 0 (for adaptive use `Adaptive`)"
    );
    assert!(
        params.spatial_scale.is_finite() && params.spatial_scale > 0.0,
        "roi_align: expected a positive spatial scale, found {}",
        params.spatial_scale
    );
    let [bins_y, bins_x] = params.output_size;
    if num_rois == 0 {
        return Tensor::zeros([0, channels, bins_y, bins_x], (&features.device(), features.dtype()));
    }
    assert!(
        num_images * channels * height * width > 0,
        "roi_align: expected feature maps of at least one pixel, found {:?}",
        features.dims()
    );
    Tensor::from_dispatch(Dispatch::kernel_roi_align(features.into_dispatch(), rois.into_dispatch(), params))
}

/// One ROI, read from a row of `[R, 5]`, as weights on the feature map.
pub(crate) struct RoiBins {
    pub(crate) image_idx: usize,
    pub(crate) y: AxisBins,
    pub(crate) x: AxisBins,
}

impl RoiBins {
    /// Weights of one ROI.
    ///
    /// # Panics
    /// Where the image index is no integer in `0..num_images`.
    pub(crate) fn new(
        roi: &[f32],
        roi_idx: usize,
        num_images: usize,
        map_size: [usize; 2],
        params: &RoiAlignParams,
    ) -> Self {
        let image_idx = roi[0];
        assert!(
            image_idx >= 0.0 && image_idx.fract() == 0.0 && image_idx < num_images as f32,
            "roi_align: expected an image index in 0..{num_images} in ROI {roi_idx}, found {image_idx}"
        );
        let axis = |low: f32, high: f32, bins: usize, map_size: usize| AxisBins::new(low, high, bins, map_size, params);
        let [bins_y, bins_x] = params.output_size;
        let [height, width] = map_size;
        Self {
            image_idx: image_idx as usize,
            y: axis(roi[2], roi[4], bins_y, height),
            x: axis(roi[1], roi[3], bins_x, width),
        }
    }
}

/// Weights of feature pixels in the bins of one ROI along one axis.
pub(crate) struct AxisBins {
    /// First feature pixel of each bin.
    first: Vec<usize>,
    /// Where each bin's weights begin in `weights`, and the end of the last.
    offsets: Vec<usize>,
    weights: Vec<f32>,
}

impl AxisBins {
    /// Weights along one axis, `low` and `high` in image pixels.
    fn new(low: f32, high: f32, bins: usize, map_size: usize, params: &RoiAlignParams) -> Self {
        let shift = match params.alignment {
            RoiAlignment::HalfPixel => 0.5,
            RoiAlignment::Legacy => 0.0,
        };
        let start = low * params.spatial_scale - shift;
        let mut extent = high * params.spatial_scale - shift - start;
        if params.alignment == RoiAlignment::Legacy {
            extent = extent.max(1.0);
        }
        let bin = extent / bins as f32;
        let grid = match params.sampling_ratio {
            SamplingRatio::Fixed(samples) => samples,
            // The cast gives 0 for a negative size.
            SamplingRatio::Adaptive => bin.ceil() as usize,
        };
        let mut axis = Self { first: Vec::with_capacity(bins), offsets: vec![0], weights: Vec::new() };
        let finite = low.is_finite() && high.is_finite() && start.is_finite() && extent.is_finite();
        for bin_idx in 0..bins {
            if finite {
                axis.push_bin(start + bin_idx as f32 * bin, bin, grid, map_size);
            } else {
                axis.first.push(0);
            }
            axis.offsets.push(axis.weights.len());
        }
        axis
    }

    /// Adds the weights of a bin that begins at `start` and is `bin` feature pixels long.
    fn push_bin(&mut self, start: f32, bin: f32, grid: usize, map_size: usize) {
        let base = self.weights.len();
        let mut first = usize::MAX;
        for sample_idx in samples_on_map(start, bin, grid, map_size) {
            let at = start + (sample_idx as f32 + 0.5) * bin / grid as f32;
            // Samples up to one pixel outside are pulled onto the border, those beyond count as zero.
            if at < -1.0 || at > map_size as f32 {
                continue;
            }
            let at = at.max(0.0);
            let low = (at as usize).min(map_size - 1);
            let high = (low + 1).min(map_size - 1);
            let fraction = if low == high { 0.0 } else { at - low as f32 };
            if first == usize::MAX {
                first = low;
            }
            // Bins of negative length, which only a fixed ratio samples, walk backwards.
            if low < first {
                let missing = first - low;
                self.weights.splice(base..base, std::iter::repeat_n(0.0, missing));
                first = low;
            }
            if self.weights.len() < base + high - first + 1 {
                self.weights.resize(base + high - first + 1, 0.0);
            }
            let share = 1.0 / grid as f32;
            self.weights[base + low - first] += (1.0 - fraction) * share;
            self.weights[base + high - first] += fraction * share;
        }
        self.first.push(if first == usize::MAX { 0 } else { first });
    }

    /// First feature pixel and weights of a bin; no weights where every sample fell outside the map.
    pub(crate) fn bin(&self, bin_idx: usize) -> (usize, &[f32]) {
        let weights = &self.weights[self.offsets[bin_idx]..self.offsets[bin_idx + 1]];
        (self.first[bin_idx], weights)
    }

    /// Writes the weights as a matrix of `[bins, map_size]`, row by row.
    pub(crate) fn write_dense(&self, matrix: &mut [f32], map_size: usize) {
        for (bin_idx, row) in matrix.chunks_exact_mut(map_size).enumerate() {
            let (first, weights) = self.bin(bin_idx);
            row[first..first + weights.len()].copy_from_slice(weights);
        }
    }
}

/// Samples that may lie on the map, so that a huge ROI costs no more than the map is long.
fn samples_on_map(start: f32, bin: f32, grid: usize, map_size: usize) -> std::ops::Range<usize> {
    let step = f64::from(bin) / grid as f64;
    if grid < 1024 || step.is_nan() || step <= 0.0 {
        return 0..grid;
    }
    // One sample of slack either side for rounding; the caller tests each sample again.
    let first = ((-1.0 - f64::from(start)) / step - 1.5).floor().max(0.0) as usize;
    let end = ((map_size as f64 - f64::from(start)) / step + 1.5).ceil().max(0.0) as usize;
    first.min(grid)..end.min(grid)
}
