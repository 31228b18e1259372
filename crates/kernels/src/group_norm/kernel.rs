//! Group normalisation on `f32` slices.
//!
//! Forwards every value becomes `scale_c · (x − mean) + beta_c` with `scale_c = gamma_c / σ`; the mean is
//! taken off first, since with it in the shift a large mean would cost digits.
//!
//! Backwards, with `x̂ = (x − mean) / σ` and g the gradient of the output (zero where the ReLU cut):
//! `grad_beta_c = Σ g`, `grad_gamma_c = Σ g·x̂`, and
//! `grad_x = (gamma_c·g − mean(gamma·g) − x̂·mean(gamma·g·x̂)) / σ`, means over the group.

use std::mem::MaybeUninit;

use super::{Activation, GroupNormParams};
use crate::parallel::{Output, SharedSlice, for_each_unit};
use crate::simd::{Isa, widest};

/// Sums run in this many lanes, so that they vectorise and are the same bits everywhere.
const LANES: usize = 32;

/// Mean and inverse standard deviation of every group of every image, `[N, G, 2]`.
pub(crate) type Statistics = Vec<[f32; 2]>;

/// The normalised maps, and the statistics the backward pass needs.
pub(crate) fn forward(
    isa: Isa,
    x: &[f32],
    shape: [usize; 4],
    gamma: &[f32],
    beta: &[f32],
    params: &GroupNormParams,
) -> (Vec<f32>, Statistics) {
    let [num_images, channels, height, width] = shape;
    let pixels = height * width;
    let groups = params.num_groups;
    let group_channels = channels / groups;
    let group_len = group_channels * pixels;
    let output = Output::new(x.len());
    let mut statistics = vec![0.0; num_images * groups * 2];
    let shared = SharedSlice::new(&mut statistics);
    for_each_unit(num_images * groups, |unit| {
        let group = &x[unit * group_len..][..group_len];
        let mean = (sum(isa, group) / group_len as f64) as f32;
        let variance = sum_of_squares(isa, group, mean) / group_len as f64;
        let inverse = (1.0 / (variance + f64::from(params.epsilon)).sqrt()) as f32;
        // SAFETY: every unit has its own group.
        unsafe { shared.range(unit * 2, 2) }.copy_from_slice(&[mean, inverse]);
        let first_channel = unit % groups * group_channels;
        for (idx, plane) in group.chunks_exact(pixels).enumerate() {
            let channel = first_channel + idx;
            let scale = gamma[channel] * inverse;
            let affine = [scale, mean, beta[channel]];
            // SAFETY: every unit has its own group.
            let target = unsafe { output.range(unit * group_len + idx * pixels, pixels) };
            match params.activation {
                Activation::Identity => normalise(isa, target, plane, affine),
                Activation::Relu => normalise_relu(isa, target, plane, affine),
            }
        }
    });
    let statistics = statistics.chunks_exact(2).map(|s| [s[0], s[1]]).collect();
    // SAFETY: the groups together are all of the output.
    (unsafe { output.into_vec() }, statistics)
}

/// Gradients of a group normalisation.
pub(crate) struct GroupNormGrads {
    pub(crate) x: Vec<f32>,
    pub(crate) gamma: Vec<f32>,
    pub(crate) beta: Vec<f32>,
}

/// The gradients, from that of the output.
pub(crate) fn backward(
    isa: Isa,
    output_grad: &[f32],
    x: &[f32],
    shape: [usize; 4],
    [gamma, beta]: [&[f32]; 2],
    statistics: &[[f32; 2]],
    params: &GroupNormParams,
) -> GroupNormGrads {
    let [num_images, channels, height, width] = shape;
    let pixels = height * width;
    let groups = params.num_groups;
    let group_channels = channels / groups;
    let group_len = group_channels * pixels;
    let output = Output::new(x.len());
    // Σ g and Σ g·x̂ of every image and channel.
    let mut sums = vec![0.0; num_images * channels * 2];
    let shared = SharedSlice::new(&mut sums);
    for_each_unit(num_images * groups, |unit| {
        let [mean, inverse] = statistics[unit];
        let first_channel = unit % groups * group_channels;
        let group = unit * group_len..(unit + 1) * group_len;
        let (x, output_grad) = (&x[group.clone()], &output_grad[group]);
        // SAFETY: every unit has its own channels of its image.
        let sums = unsafe { shared.range(unit * group_channels * 2, group_channels * 2) };
        // The ReLU passes g where y, computed as forwards, is above 0.
        let affine = |channel: usize| [gamma[channel] * inverse, mean, beta[channel]];
        let planes = || x.chunks_exact(pixels).zip(output_grad.chunks_exact(pixels));
        let (mut sum_g, mut sum_gx) = (0.0_f64, 0.0_f64);
        for (idx, (x, g)) in planes().enumerate() {
            let channel = first_channel + idx;
            let [of_g, of_gx] = match params.activation {
                Activation::Identity => grad_sums(isa, g, x, mean),
                Activation::Relu => grad_sums_relu(isa, g, x, affine(channel)),
            };
            let of_gx = of_gx * f64::from(inverse);
            sums[idx * 2] = of_g as f32;
            sums[idx * 2 + 1] = of_gx as f32;
            sum_g += f64::from(gamma[channel]) * of_g;
            sum_gx += f64::from(gamma[channel]) * of_gx;
        }
        let mean_g = (sum_g / group_len as f64) as f32;
        let mean_gx = (sum_gx / group_len as f64) as f32;
        for (idx, (x, g)) in planes().enumerate() {
            let channel = first_channel + idx;
            // grad_x = scale·g + slope·(x − mean) + constant
            let slope = -inverse * inverse * mean_gx;
            let constant = -inverse * mean_g;
            // SAFETY: every unit has its own group.
            let target = unsafe { output.range(unit * group_len + idx * pixels, pixels) };
            let affine = affine(channel);
            match params.activation {
                Activation::Identity => combine(isa, target, g, x, affine, [slope, constant]),
                Activation::Relu => combine_relu(isa, target, g, x, affine, [slope, constant]),
            }
        }
    });
    let mut grads = GroupNormGrads {
        // SAFETY: the groups together are all of the input.
        x: unsafe { output.into_vec() },
        gamma: vec![0.0; channels],
        beta: vec![0.0; channels],
    };
    for image in sums.chunks_exact(channels * 2) {
        for (channel, sums) in image.chunks_exact(2).enumerate() {
            grads.beta[channel] += sums[0];
            grads.gamma[channel] += sums[1];
        }
    }
    grads
}

/// Sums `term(i)` over a plane of `len` values, in lanes.
#[inline(always)]
fn sum_lanes<const N: usize>(len: usize, term: impl Fn(usize) -> [f32; N]) -> [f64; N] {
    // Short runs of f32 lanes, so that rounding does not grow with the plane.
    const RUN: usize = 64 * LANES;
    let mut total = [0.0_f64; N];
    let mut start = 0;
    while start < len {
        let end = len.min(start + RUN);
        let mut lanes = [[0.0_f32; LANES]; N];
        let whole = (end - start) / LANES * LANES;
        for block in (start..start + whole).step_by(LANES) {
            for lane in 0..LANES {
                for (lanes, term) in lanes.iter_mut().zip(term(block + lane)) {
                    lanes[lane] += term;
                }
            }
        }
        for at in start + whole..end {
            let terms = term(at);
            for n in 0..N {
                lanes[n][at - start - whole] += terms[n];
            }
        }
        for n in 0..N {
            total[n] += f64::from(lanes[n].iter().sum::<f32>());
        }
        start = end;
    }
    total
}

widest! {
    fn sum(values: &[f32]) -> f64 {
        sum_lanes(values.len(), |at| [values[at]])[0]
    }
}

widest! {
    fn sum_of_squares(values: &[f32], mean: f32) -> f64 {
        sum_lanes(values.len(), |at| [(values[at] - mean) * (values[at] - mean)])[0]
    }
}

widest! {
    fn normalise(target: &mut [MaybeUninit<f32>], x: &[f32], affine: [f32; 3]) -> () {
        let [scale, mean, shift] = affine;
        for (target, x) in target.iter_mut().zip(x) {
            target.write(scale * (x - mean) + shift);
        }
    }
}

widest! {
    fn normalise_relu(target: &mut [MaybeUninit<f32>], x: &[f32], affine: [f32; 3]) -> () {
        let [scale, mean, shift] = affine;
        for (target, x) in target.iter_mut().zip(x) {
            let y = scale * (x - mean) + shift;
            // Written so that a NaN stays one.
            target.write(if y <= 0.0 { 0.0 } else { y });
        }
    }
}

widest! {
    fn grad_sums(g: &[f32], x: &[f32], mean: f32) -> [f64; 2] {
        let x = &x[..g.len()];
        sum_lanes(g.len(), |at| [g[at], g[at] * (x[at] - mean)])
    }
}

widest! {
    fn grad_sums_relu(g: &[f32], x: &[f32], affine: [f32; 3]) -> [f64; 2] {
        let [scale, mean, shift] = affine;
        let x = &x[..g.len()];
        sum_lanes(g.len(), |at| {
            let centred = x[at] - mean;
            let g = if scale * centred + shift <= 0.0 { 0.0 } else { g[at] };
            [g, g * centred]
        })
    }
}

widest! {
    fn combine(
        target: &mut [MaybeUninit<f32>],
        g: &[f32],
        x: &[f32],
        affine: [f32; 3],
        group: [f32; 2],
    ) -> () {
        let ([scale, mean, _], [slope, constant]) = (affine, group);
        for ((target, g), x) in target.iter_mut().zip(g).zip(x) {
            target.write(scale * g + slope * (x - mean) + constant);
        }
    }
}

widest! {
    fn combine_relu(
        target: &mut [MaybeUninit<f32>],
        g: &[f32],
        x: &[f32],
        affine: [f32; 3],
        group: [f32; 2],
    ) -> () {
        let ([scale, mean, shift], [slope, constant]) = (affine, group);
        for ((target, g), x) in target.iter_mut().zip(g).zip(x) {
            let centred = x - mean;
            let g = if scale * centred + shift <= 0.0 { 0.0 } else { *g };
            target.write(scale * g + slope * centred + constant);
        }
    }
}
