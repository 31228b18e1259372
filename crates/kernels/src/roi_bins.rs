//! The feature pixels and weights of the bins of an ROI.

use crate::params::{RoiAlignParams, RoiAlignment, SamplingRatio};

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
    /// If the image index is not an integer in `0..num_images`.
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
    /// Start of each bin's weights in `weights`, and the end of the last.
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

    /// Adds the weights of a bin that starts at `start` and is `bin` feature pixels long.
    fn push_bin(&mut self, start: f32, bin: f32, grid: usize, map_size: usize) {
        let base = self.weights.len();
        let mut first = usize::MAX;
        for sample_idx in samples_on_map(start, bin, grid, map_size) {
            let at = start + (sample_idx as f32 + 0.5) * bin / grid as f32;
            // Samples up to one pixel outside are moved onto the border; those further away count as zero.
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
            // Bins of negative length, which only a fixed ratio samples, run backwards.
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

    /// First feature pixel and weights of a bin; no weights if every sample is outside the map.
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

/// Range of samples that may lie on the map, so a huge ROI costs no more than the map's length.
fn samples_on_map(start: f32, bin: f32, grid: usize, map_size: usize) -> std::ops::Range<usize> {
    let step = f64::from(bin) / grid as f64;
    if grid < 1024 || step.is_nan() || step <= 0.0 {
        return 0..grid;
    }
    // One additional sample on both sides for rounding; the caller tests each sample again.
    let first = ((-1.0 - f64::from(start)) / step - 1.5).floor().max(0.0) as usize;
    let end = ((map_size as f64 - f64::from(start)) / step + 1.5).ceil().max(0.0) as usize;
    first.min(grid)..end.min(grid)
}
