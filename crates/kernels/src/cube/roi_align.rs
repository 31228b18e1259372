//! ROIAlign in CubeCL: one unit of work per output value.
//!
//! ```text
//! output (r, c, i, j) = mean over the bin's samples (y, x) of the bilinear feature (image of r, c, y, x)
//! ```
//!
//! The conventions are those of [`AxisBins`](crate::roi_bins::AxisBins), sample by sample. One difference: an invalid
//! image index is rounded down and limited to the batch, because a kernel cannot return an error.

use burn::backend::Cube;
use burn::backend::ops::FloatTensorOps;
use burn::backend::tensor::FloatTensor;
use burn::cubecl;
use burn::tensor::{DType, Shape};
use cubecl::prelude::*;

use crate::params::{RoiAlignParams, RoiAlignment, SamplingRatio};

/// Like [`roi_align`](crate::roi_align()), for `f32` tensors whose shapes were checked.
pub(super) fn launched(
    features: FloatTensor<Cube>,
    rois: FloatTensor<Cube>,
    params: RoiAlignParams,
) -> FloatTensor<Cube> {
    let (num_rois, channels) = (rois.meta.shape()[0], features.meta.shape()[1]);
    let [bins_y, bins_x] = params.output_size;
    let shape = Shape::from(vec![num_rois, channels, bins_y, bins_x]);
    let count = shape.num_elements();
    let crops = Cube::float_empty(shape, &features.device, DType::F32.into());
    let client = features.client.clone();
    let cube_dim = CubeDim::new(&client, count);
    let samples = match params.sampling_ratio {
        SamplingRatio::Adaptive => 0,
        SamplingRatio::Fixed(samples) => samples as u32,
    };
    roi_align_kernel::launch(
        &client,
        cubecl::calculate_cube_count_elemwise(&client, count, cube_dim),
        cube_dim,
        features.into_tensor_arg(),
        rois.into_tensor_arg(),
        crops.clone().into_tensor_arg(),
        params.spatial_scale,
        samples,
        params.alignment == RoiAlignment::HalfPixel,
    );
    crops
}

/// ROIAlign of one output value. `samples` is the number of samples per bin and axis; 0 for the length of the bin in
/// feature pixels, rounded up.
#[cube(launch)]
fn roi_align_kernel(
    features: &Tensor<f32>,
    rois: &Tensor<f32>,
    crops: &mut Tensor<f32>,
    spatial_scale: f32,
    #[comptime] samples: u32,
    #[comptime] half_pixel: bool,
) {
    let (channels, bins_y, bins_x) = (crops.shape(1), crops.shape(2), crops.shape(3));
    if ABSOLUTE_POS >= crops.shape(0) * channels * bins_y * bins_x {
        terminate!();
    }
    let bin_x = ABSOLUTE_POS % bins_x;
    let bin_y = ABSOLUTE_POS / bins_x % bins_y;
    let channel = ABSOLUTE_POS / (bins_x * bins_y) % channels;
    let roi_idx = ABSOLUTE_POS / (bins_x * bins_y * channels);

    let roi = roi_idx * rois.stride(0);
    let column = rois.stride(1);
    let image = min(usize::cast_from(max(rois[roi], f32::new(0.0))), features.shape(0) - 1);
    let plane = image * features.stride(0) + channel * features.stride(1);
    let (height, width) = (features.shape(2), features.shape(3));
    let (stride_y, stride_x) = (features.stride(2), features.stride(3));

    // For each axis: the start of the bin, its length, its first sample, the number of samples, and the divisor of the
    // mean.
    let low_y = rois[roi + 2 * column];
    let high_y = rois[roi + 4 * column];
    let (start_y, bin_size_y, first_y, count_y, grid_y) =
        axis_samples(low_y, high_y, bin_y, bins_y, height, spatial_scale, samples, half_pixel);
    let low_x = rois[roi + column];
    let high_x = rois[roi + 3 * column];
    let (start_x, bin_size_x, first_x, count_x, grid_x) =
        axis_samples(low_x, high_x, bin_x, bins_x, width, spatial_scale, samples, half_pixel);

    let mut sum = f32::new(0.0);
    for sample_y in 0..count_y {
        let at_y = start_y + (first_y + f32::cast_from(sample_y) + f32::new(0.5)) * bin_size_y / grid_y;
        // Samples up to one pixel outside are moved onto the border; those further away count as zero.
        if at_y >= f32::new(-1.0) && at_y <= f32::cast_from(height) {
            let from_y = max(at_y, f32::new(0.0));
            let top = min(usize::cast_from(from_y), height - 1);
            let bottom = min(top + 1, height - 1);
            let part_y = select(top == bottom, f32::new(0.0), from_y - f32::cast_from(top));
            for sample_x in 0..count_x {
                let at_x = start_x + (first_x + f32::cast_from(sample_x) + f32::new(0.5)) * bin_size_x / grid_x;
                if at_x >= f32::new(-1.0) && at_x <= f32::cast_from(width) {
                    let from_x = max(at_x, f32::new(0.0));
                    let left = min(usize::cast_from(from_x), width - 1);
                    let right = min(left + 1, width - 1);
                    let part_x = select(left == right, f32::new(0.0), from_x - f32::cast_from(left));
                    let above = features[plane + top * stride_y + left * stride_x] * (f32::new(1.0) - part_x)
                        + features[plane + top * stride_y + right * stride_x] * part_x;
                    let below = features[plane + bottom * stride_y + left * stride_x] * (f32::new(1.0) - part_x)
                        + features[plane + bottom * stride_y + right * stride_x] * part_x;
                    sum += above * (f32::new(1.0) - part_y) + below * part_y;
                }
            }
        }
    }
    crops[ABSOLUTE_POS] = sum / max(grid_y * grid_x, f32::new(1.0));
}

/// The samples of one bin along one axis that may lie on the map: the bin's start and length in feature pixels, the
/// first sample, the number of samples from it on, and the number of all samples, on the map and off it. If a corner is
/// not finite, the number of samples from the first on is 0.
#[cube]
fn axis_samples(
    low: f32,
    high: f32,
    bin_idx: usize,
    bins: usize,
    map_size: usize,
    spatial_scale: f32,
    #[comptime] samples: u32,
    #[comptime] half_pixel: bool,
) -> (f32, f32, f32, u32, f32) {
    let shift = if comptime!(half_pixel) { f32::new(0.5) } else { f32::new(0.0) };
    let start = low * spatial_scale - shift;
    let mut extent = high * spatial_scale - shift - start;
    if comptime!(!half_pixel) {
        extent = max(extent, f32::new(1.0));
    }
    let bin = extent / f32::cast_from(bins);
    let bin_start = start + f32::cast_from(bin_idx) * bin;
    let grid = if comptime!(samples == 0) { max(bin.ceil(), f32::new(0.0)) } else { f32::cast_from(samples) };
    let mut first = f32::new(0.0);
    let mut count = grid;
    let size = f32::cast_from(map_size);
    if comptime!(samples == 0) && grid >= f32::new(1024.0) {
        // A step is at least half a pixel here, so a huge ROI costs no more than the map's length. One additional
        // sample on both sides covers rounding.
        let step = bin / grid;
        first = max(((f32::new(-1.0) - bin_start) / step - f32::new(1.5)).floor(), f32::new(0.0));
        let end = min(((size - bin_start) / step + f32::new(1.5)).ceil(), grid);
        count = min(max(end - first, f32::new(0.0)), f32::new(2.0) * size + f32::new(8.0));
    }
    if !(is_real(low) && is_real(high) && is_real(start) && is_real(extent)) {
        count = f32::new(0.0);
    }
    (bin_start, bin, first, u32::cast_from(count), grid)
}

/// Whether a number is finite, tested by its bits: shading languages may assume that every number is finite.
#[cube]
fn is_real(value: f32) -> bool {
    u32::reinterpret(value) & 0x7f80_0000u32 != 0x7f80_0000u32
}
