//! Reference implementations for the tests, as plain loops, and random values.

use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

use crate::conv::shape::ConvShape;
use crate::params::{RoiAlignParams, RoiAlignment, SamplingRatio};

/// Values in [-1, 1).
pub(crate) fn random_values(len: usize, seed: u64) -> Vec<f32> {
    let mut rng = Pcg64Mcg::seed_from_u64(seed);
    (0..len).map(|_| rng.random_range(-1.0..1.0)).collect()
}

/// `[N, C, H, W]` to `[N, H, W, C]`.
pub(crate) fn to_last(values: &[f32], [num_images, channels, height, width]: [usize; 4]) -> Vec<f32> {
    let pixels = height * width;
    (0..num_images * pixels * channels)
        .map(|at| values[(at / channels / pixels * channels + at % channels) * pixels + at / channels % pixels])
        .collect()
}

/// `[N, H, W, C]` to `[N, C, H, W]`, which is the given shape.
pub(crate) fn to_first(values: &[f32], [num_images, channels, height, width]: [usize; 4]) -> Vec<f32> {
    to_last(values, [num_images, height * width, channels, 1])
}

/// Asserts equality up to rounding: sums in a different order differ by a few units in the last place of
/// their largest terms.
pub(crate) fn assert_close(found: &[f32], expected: &[f32], what: &str) {
    const TOLERANCE: f32 = 2e-5;
    assert_eq!(found.len(), expected.len(), "{what}: length");
    let scale = expected.iter().fold(1.0_f32, |max, v| max.max(v.abs()));
    for (idx, (found, expected)) in found.iter().zip(expected).enumerate() {
        assert!((found - expected).abs() <= TOLERANCE * scale, "{what}: element {idx} is {found}, expected {expected}");
    }
}

/// Calls `visit(input element, weight element, output element)` for every product of a convolution.
fn for_each_product(shape: &ConvShape, mut visit: impl FnMut(usize, usize, usize)) {
    let [num_images, in_channels, in_height, in_width] = shape.input();
    let [_, out_channels, out_height, out_width] = shape.output();
    let [kernel_height, kernel_width] = shape.kernel;
    let [step_y, step_x] = shape.params.stride;
    let [padding_y, padding_x] = shape.params.padding;
    for n in 0..num_images {
        for m in 0..out_channels {
            for y in 0..out_height {
                for x in 0..out_width {
                    for c in 0..in_channels {
                        for ky in 0..kernel_height {
                            for kx in 0..kernel_width {
                                let in_y = (y * step_y + ky).wrapping_sub(padding_y);
                                let in_x = (x * step_x + kx).wrapping_sub(padding_x);
                                if in_y < in_height && in_x < in_width {
                                    visit(
                                        ((n * in_channels + c) * in_height + in_y) * in_width + in_x,
                                        ((m * in_channels + c) * kernel_height + ky) * kernel_width + kx,
                                        ((n * out_channels + m) * out_height + y) * out_width + x,
                                    );
                                }
                            }
                        }
                    }
                }
            }
        }
    }
}

fn to_f32(values: &[f64]) -> Vec<f32> {
    values.iter().map(|&value| value as f32).collect()
}

/// Convolution, by its definition.
pub(crate) fn conv_forward(x: &[f32], weight: &[f32], bias: &[f32], shape: &ConvShape) -> Vec<f32> {
    let [_, channels, height, width] = shape.output();
    let mut output: Vec<f64> = (0..shape.output().iter().product())
        .map(|idx: usize| f64::from(bias[idx / (height * width) % channels]))
        .collect();
    for_each_product(shape, |i, w, o| {
        output[o] += f64::from(x[i]) * f64::from(weight[w]);
    });
    to_f32(&output)
}

/// The gradient with respect to the input.
pub(crate) fn conv_input_gradient(output_grad: &[f32], weight: &[f32], shape: &ConvShape) -> Vec<f32> {
    let mut grad = vec![0.0_f64; shape.input().iter().product()];
    for_each_product(shape, |i, w, o| {
        grad[i] += f64::from(output_grad[o]) * f64::from(weight[w]);
    });
    to_f32(&grad)
}

/// The gradient with respect to the weight.
pub(crate) fn conv_weight_gradient(x: &[f32], output_grad: &[f32], shape: &ConvShape) -> Vec<f32> {
    let mut grad = vec![0.0_f64; shape.weight().iter().product()];
    for_each_product(shape, |i, w, o| {
        grad[w] += f64::from(output_grad[o]) * f64::from(x[i]);
    });
    to_f32(&grad)
}

/// Calls `visit(feature element, crop element, weight)` for every bilinear term of every ROIAlign sample.
fn for_each_term(shape: [usize; 4], rois: &[f32], params: &RoiAlignParams, mut visit: impl FnMut(usize, usize, f32)) {
    let [_, channels, height, width] = shape;
    let [bins_y, bins_x] = params.output_size;
    for (roi_idx, roi) in rois.chunks_exact(5).enumerate() {
        let shift = match params.alignment {
            RoiAlignment::HalfPixel => 0.5,
            RoiAlignment::Legacy => 0.0,
        };
        let corner = |idx: usize| roi[idx] * params.spatial_scale - shift;
        let (mut roi_width, mut roi_height) = (corner(3) - corner(1), corner(4) - corner(2));
        if params.alignment == RoiAlignment::Legacy {
            roi_width = roi_width.max(1.0);
            roi_height = roi_height.max(1.0);
        }
        let (bin_width, bin_height) = (roi_width / bins_x as f32, roi_height / bins_y as f32);
        let (grid_x, grid_y) = match params.sampling_ratio {
            SamplingRatio::Fixed(samples) => (samples, samples),
            SamplingRatio::Adaptive => (bin_width.ceil() as usize, bin_height.ceil() as usize),
        };
        let count = (grid_x * grid_y).max(1) as f32;
        for bin_y in 0..bins_y {
            for bin_x in 0..bins_x {
                for sample_y in 0..grid_y {
                    for sample_x in 0..grid_x {
                        let y = corner(2)
                            + bin_y as f32 * bin_height
                            + (sample_y as f32 + 0.5) * bin_height / grid_y as f32;
                        let x =
                            corner(1) + bin_x as f32 * bin_width + (sample_x as f32 + 0.5) * bin_width / grid_x as f32;
                        if y < -1.0 || y > height as f32 || x < -1.0 || x > width as f32 {
                            continue;
                        }
                        let (y, x) = (y.max(0.0), x.max(0.0));
                        let (mut low_y, mut low_x) = (y as usize, x as usize);
                        let (mut part_y, mut part_x) = (y - low_y as f32, x - low_x as f32);
                        if low_y >= height - 1 {
                            (low_y, part_y) = (height - 1, 0.0);
                        }
                        if low_x >= width - 1 {
                            (low_x, part_x) = (width - 1, 0.0);
                        }
                        let high_y = (low_y + 1).min(height - 1);
                        let high_x = (low_x + 1).min(width - 1);
                        for channel in 0..channels {
                            let plane = (roi[0] as usize * channels + channel) * height * width;
                            let crop = ((roi_idx * channels + channel) * bins_y + bin_y) * bins_x + bin_x;
                            let mut term = |y: usize, x: usize, weight: f32| {
                                visit(plane + y * width + x, crop, weight / count);
                            };
                            term(low_y, low_x, (1.0 - part_y) * (1.0 - part_x));
                            term(low_y, high_x, (1.0 - part_y) * part_x);
                            term(high_y, low_x, part_y * (1.0 - part_x));
                            term(high_y, high_x, part_y * part_x);
                        }
                    }
                }
            }
        }
    }
}

/// ROIAlign, by its definition.
pub(crate) fn roi_align_forward(
    features: &[f32],
    shape: [usize; 4],
    rois: &[f32],
    params: &RoiAlignParams,
) -> Vec<f32> {
    let [bins_y, bins_x] = params.output_size;
    let mut crops = vec![0.0_f64; rois.len() / 5 * shape[1] * bins_y * bins_x];
    for_each_term(shape, rois, params, |feature, crop, weight| {
        crops[crop] += f64::from(features[feature]) * f64::from(weight);
    });
    to_f32(&crops)
}

/// The gradient of ROIAlign with respect to the features.
pub(crate) fn roi_align_backward(
    crop_grad: &[f32],
    shape: [usize; 4],
    rois: &[f32],
    params: &RoiAlignParams,
) -> Vec<f32> {
    let mut grad = vec![0.0_f64; shape.iter().product()];
    for_each_term(shape, rois, params, |feature, crop, weight| {
        grad[feature] += f64::from(crop_grad[crop]) * f64::from(weight);
    });
    to_f32(&grad)
}
