//! Max pooling and doubling of a map's height and width, on channels-last `f32` slices, `[N, H, W, C]`.

use super::MaxPool2dParams;
use crate::parallel::{SharedSlice, for_each_unit};
use crate::simd::{Isa, widest};

/// Sizes of a pooling.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PoolShape {
    pub(crate) num_images: usize,
    pub(crate) channels: usize,
    pub(crate) in_size: [usize; 2],
    pub(crate) out_size: [usize; 2],
    pub(crate) params: MaxPool2dParams,
}

impl PoolShape {
    pub(crate) fn new([num_images, channels, height, width]: [usize; 4], params: MaxPool2dParams) -> Self {
        let in_size = [height, width];
        let out_size = params.output_size(in_size).expect("the window fits, checked by `max_pool2d`");
        Self { num_images, channels, in_size, out_size, params }
    }

    /// Shape of the input, `[N, C, Hi, Wi]`.
    pub(crate) fn input(&self) -> [usize; 4] {
        [self.num_images, self.channels, self.in_size[0], self.in_size[1]]
    }

    /// Shape of the output, `[N, C, Ho, Wo]`.
    pub(crate) fn output(&self) -> [usize; 4] {
        [self.num_images, self.channels, self.out_size[0], self.out_size[1]]
    }

    /// Calls `visit(cell, input pixel)` for every cell of the window at an output pixel that is inside the map.
    #[inline(always)]
    fn for_each_cell(&self, [y, x]: [usize; 2], mut visit: impl FnMut(u8, usize)) {
        let MaxPool2dParams { kernel, stride, padding } = self.params;
        for cell_y in 0..kernel[0] {
            let y = (y * stride[0] + cell_y).wrapping_sub(padding[0]);
            for cell_x in 0..kernel[1] {
                let x = (x * stride[1] + cell_x).wrapping_sub(padding[1]);
                if y < self.in_size[0] && x < self.in_size[1] {
                    visit((cell_y * kernel[1] + cell_x) as u8, y * self.in_size[1] + x);
                }
            }
        }
    }
}

/// Max pooling.
pub(crate) fn max_pool(isa: Isa, x: &[f32], shape: &PoolShape) -> Vec<f32> {
    let channels = shape.channels;
    let [out_height, out_width] = shape.out_size;
    let image_len = shape.in_size[0] * shape.in_size[1] * channels;
    let row_len = out_width * channels;
    let mut output = vec![0.0; shape.num_images * out_height * row_len];
    let shared = SharedSlice::new(&mut output);
    for_each_unit(shape.num_images * out_height, |unit| {
        let (image, y) = (unit / out_height, unit % out_height);
        let image = &x[image * image_len..][..image_len];
        // SAFETY: every unit has its own row.
        let row = unsafe { shared.range(unit * row_len, row_len) };
        for (x, largest) in row.chunks_exact_mut(channels).enumerate() {
            largest.fill(f32::NEG_INFINITY);
            shape.for_each_cell([y, x], |_, pixel| keep_larger(isa, largest, &image[pixel * channels..][..channels]));
        }
    });
    output
}

/// The gradient with respect to the input: each output's gradient goes to the first of the window's largest values.
pub(crate) fn max_pool_gradient(
    isa: Isa,
    output_grad: &[f32],
    x: &[f32],
    output: &[f32],
    shape: &PoolShape,
) -> Vec<f32> {
    /// Number of channels of a unit, so that few images are also distributed.
    const BLOCK: usize = 16;
    let channels = shape.channels;
    let [out_height, out_width] = shape.out_size;
    let pixels = shape.in_size[0] * shape.in_size[1];
    let mut grad = vec![0.0; x.len()];
    let shared = SharedSlice::new(&mut grad);
    let blocks = channels.div_ceil(BLOCK);
    for_each_unit(shape.num_images * blocks, |unit| {
        let (image, first) = (unit / blocks, unit % blocks * BLOCK);
        let count = BLOCK.min(channels - first);
        for y in 0..out_height {
            for x_out in 0..out_width {
                let at = ((image * out_height + y) * out_width + x_out) * channels + first;
                let (largest, from) = (&output[at..at + count], &output_grad[at..at + count]);
                // The gradient that remains to be distributed.
                let mut left = [0.0_f32; BLOCK];
                left[..count].copy_from_slice(from);
                shape.for_each_cell([y, x_out], |_, pixel| {
                    let at = (image * pixels + pixel) * channels + first;
                    // SAFETY: every unit has its own image and channels.
                    let grad = unsafe { shared.range(at, count) };
                    give_to_largest(isa, grad, &mut left[..count], &x[at..at + count], largest);
                });
            }
        }
    });
    grad
}

/// Repeats each pixel four times: `[N, 2H, 2W, C]`.
pub(crate) fn upsample(x: &[f32], [num_images, channels, height, width]: [usize; 4]) -> Vec<f32> {
    let row_len = width * channels;
    let mut output = vec![0.0; 4 * x.len()];
    let shared = SharedSlice::new(&mut output);
    for_each_unit(num_images * height, |unit| {
        let row = &x[unit * row_len..][..row_len];
        // SAFETY: every unit has its own two rows.
        let rows = unsafe { shared.range(unit * 4 * row_len, 4 * row_len) };
        let (upper, lower) = rows.split_at_mut(2 * row_len);
        for (pair, pixel) in upper.chunks_exact_mut(2 * channels).zip(row.chunks_exact(channels)) {
            let (left, right) = pair.split_at_mut(channels);
            left.copy_from_slice(pixel);
            right.copy_from_slice(pixel);
        }
        lower.copy_from_slice(upper);
    });
    output
}

/// The gradient with respect to the input: sums of four pixels of the output's gradient.
pub(crate) fn upsample_gradient(
    isa: Isa,
    output_grad: &[f32],
    [num_images, channels, height, width]: [usize; 4],
) -> Vec<f32> {
    let row_len = width * channels;
    let mut grad = vec![0.0; num_images * height * row_len];
    let shared = SharedSlice::new(&mut grad);
    for_each_unit(num_images * height, |unit| {
        // SAFETY: every unit has its own row.
        let row = unsafe { shared.range(unit * row_len, row_len) };
        let (upper, lower) = output_grad[unit * 4 * row_len..][..4 * row_len].split_at(2 * row_len);
        for (x, pixel) in row.chunks_exact_mut(channels).enumerate() {
            let at = 2 * x * channels;
            let [upper, lower] = [&upper[at..at + 2 * channels], &lower[at..at + 2 * channels]];
            add_four(isa, pixel, upper, lower);
        }
    });
    grad
}

widest! {
    fn keep_larger(largest: &mut [f32], values: &[f32]) -> () {
        for (largest, value) in largest.iter_mut().zip(values) {
            // A NaN is the maximum, and stays NaN.
            *largest = if *value <= *largest || largest.is_nan() { *largest } else { *value };
        }
    }
}

widest! {
    fn give_to_largest(grad: &mut [f32], left: &mut [f32], values: &[f32], largest: &[f32]) -> () {
        for (((grad, left), value), largest) in grad.iter_mut().zip(left).zip(values).zip(largest) {
            let is_largest = *value == *largest || value.is_nan();
            *grad += if is_largest { *left } else { 0.0 };
            *left = if is_largest { 0.0 } else { *left };
        }
    }
}

widest! {
    fn add_four(sum: &mut [f32], upper: &[f32], lower: &[f32]) -> () {
        let channels = sum.len();
        let (upper, lower) = (&upper[..2 * channels], &lower[..2 * channels]);
        for c in 0..channels {
            sum[c] = (upper[c] + upper[channels + c]) + (lower[c] + lower[channels + c]);
        }
    }
}
