//! Passes over channels-last maps, `[P, C]` for P positions of all images.

use std::mem::MaybeUninit;

use crate::parallel::{Output, SharedSlice, for_each_unit};
use crate::scratch::Scratch;
use crate::simd::{Isa, transpose, widest};

/// Number of positions that are summed in `f32` before the sum is added to an `f64`.
const CHUNK: usize = 512;

/// Sums over positions, the gradient with respect to a bias.
pub(crate) fn channel_sums(isa: Isa, values: &[f32], channels: usize) -> Vec<f32> {
    sum_chunks(values.len() / channels, channels, |positions, sums| {
        for position in positions {
            add(isa, sums, &values[position * channels..][..channels]);
        }
    })
}

/// The gradient at values that a ReLU passed, zero at others, and its sums over
/// positions.
pub(crate) fn relu_gradient(isa: Isa, grad: &[f32], output: &[f32], channels: usize) -> (Vec<f32>, Vec<f32>) {
    let masked = Output::new(grad.len());
    let sums = sum_chunks(grad.len() / channels, channels, |positions, sums| {
        let range = positions.start * channels..positions.end * channels;
        // SAFETY: every chunk has its own positions.
        let target = unsafe { masked.range(range.start, range.len()) };
        mask(isa, target, &grad[range.clone()], &output[range.clone()]);
        // SAFETY: written just now.
        let written = unsafe { std::slice::from_raw_parts(target.as_ptr().cast::<f32>(), range.len()) };
        for values in written.chunks_exact(channels) {
            add(isa, sums, values);
        }
    });
    // SAFETY: the chunks together are all positions.
    (unsafe { masked.into_vec() }, sums)
}

/// Multiplies every channel by its factor.
pub(crate) fn scale_channels(isa: Isa, values: &mut [f32], factors: &[f32]) {
    let channels = factors.len();
    let positions = values.len() / channels;
    let shared = SharedSlice::new(values);
    for_each_unit(positions.div_ceil(CHUNK), |chunk| {
        let range = chunk * CHUNK..positions.min((chunk + 1) * CHUNK);
        // SAFETY: every chunk has its own positions.
        let values = unsafe { shared.range(range.start * channels, range.len() * channels) };
        for values in values.chunks_exact_mut(channels) {
            multiply(isa, values, factors);
        }
    });
}

/// The sum of two lists of values.
pub(crate) fn sum(isa: Isa, a: &[f32], b: &[f32]) -> Vec<f32> {
    /// Values that one thread computes at a time.
    const BLOCK: usize = 32 * 1024;
    let output = Output::new(a.len());
    for_each_unit(a.len().div_ceil(BLOCK), |unit| {
        let range = unit * BLOCK..a.len().min((unit + 1) * BLOCK);
        // SAFETY: every unit has its own values.
        let target = unsafe { output.range(range.start, range.len()) };
        add_to(isa, target, &a[range.clone()], &b[range]);
    });
    // SAFETY: the units together are all values.
    unsafe { output.into_vec() }
}

/// Sums of chunks of positions, added in their order.
fn sum_chunks(
    positions: usize,
    channels: usize,
    add: impl Fn(std::ops::Range<usize>, &mut [f32]) + Sync + Send,
) -> Vec<f32> {
    let chunks = positions.div_ceil(CHUNK);
    let mut partial = Scratch::take(chunks * channels);
    let shared = SharedSlice::new(&mut partial);
    for_each_unit(chunks, |chunk| {
        // SAFETY: every chunk has its own sums.
        let sums = unsafe { shared.range(chunk * channels, channels) };
        sums.fill(0.0);
        add(chunk * CHUNK..positions.min((chunk + 1) * CHUNK), sums);
    });
    let mut total = vec![0.0_f64; channels];
    for sums in partial.chunks_exact(channels) {
        for (total, sum) in total.iter_mut().zip(sums) {
            *total += f64::from(*sum);
        }
    }
    total.into_iter().map(|total| total as f32).collect()
}

/// `[N, C, P]` to `[N, P, C]`, or, with `channels` and `pixels` exchanged, back.
pub(crate) fn channels_last(isa: Isa, values: &[f32], num_images: usize, channels: usize, pixels: usize) -> Vec<f32> {
    /// Pixels per unit: its 128 runs of 64 channels are 32 KB.
    const BLOCK: usize = 128;
    let output = Output::new(values.len());
    let blocks = pixels.div_ceil(BLOCK);
    for_each_unit(num_images * blocks, |unit| {
        let (image, block) = (unit / blocks, unit % blocks);
        let range = block * BLOCK..pixels.min((block + 1) * BLOCK);
        let start = image * channels * pixels;
        // SAFETY: every unit has its own pixels.
        let target = unsafe { output.range(start + range.start * channels, range.len() * channels) };
        // SAFETY: floats that are all written by the transposition, and not read before.
        let target = unsafe { std::slice::from_raw_parts_mut(target.as_mut_ptr().cast::<f32>(), target.len()) };
        let source = &values[start + range.start..start + channels * pixels];
        transpose(isa, source, pixels, target, channels, channels, range.len());
    });
    // SAFETY: the blocks together are all pixels.
    unsafe { output.into_vec() }
}

widest! {
    fn add(sums: &mut [f32], values: &[f32]) -> () {
        for (sum, value) in sums.iter_mut().zip(values) {
            *sum += value;
        }
    }
}

widest! {
    fn add_to(target: &mut [MaybeUninit<f32>], a: &[f32], b: &[f32]) -> () {
        for ((target, a), b) in target.iter_mut().zip(a).zip(b) {
            target.write(a + b);
        }
    }
}

widest! {
    fn multiply(values: &mut [f32], factors: &[f32]) -> () {
        for (value, factor) in values.iter_mut().zip(factors) {
            *value *= factor;
        }
    }
}

widest! {
    fn mask(target: &mut [MaybeUninit<f32>], grad: &[f32], output: &[f32]) -> () {
        for ((target, grad), output) in target.iter_mut().zip(grad).zip(output) {
            // Written so that a NaN output passes the gradient.
            target.write(if *output <= 0.0 { 0.0 } else { *grad });
        }
    }
}
