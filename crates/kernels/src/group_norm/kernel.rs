//! Group normalisation on channels-last `f32` slices, `[N, P, C]`.
//!
//! In the forward pass every value becomes `scale_c · (x − mean) + beta_c (+ residual)` with `scale_c = gamma_c / σ`;
//! the mean is subtracted first, since a large mean inside the shift would cost digits. Mean and variance come from
//! one pass: sums of x − p and (x − p)², where p is the channel's value at the image's first pixel.
//!
//! In the backward pass, with `x̂ = (x − mean) / σ` and g the gradient of the output (zero where the
//! ReLU is inactive): `grad_beta_c = Σ g`, `grad_gamma_c = Σ g·x̂`, and `grad_x = (gamma_c·g −
//! mean(gamma·g) − x̂·mean(gamma·g·x̂)) / σ`, means over the group.

use std::mem::MaybeUninit;

use crate::parallel::{Output, SharedSlice, for_each_unit};
use crate::params::{Activation, GroupNormParams};
use crate::scratch::Scratch;
use crate::simd::{Isa, widest};

/// Pixels of a unit, summed in `f32` before the sum is added to an `f64`.
const CHUNK: usize = 256;

/// Mean and inverse standard deviation of every group of every image, `[N, G, 2]`.
pub(crate) type Statistics = Vec<[f32; 2]>;

/// Sizes of the maps, and their division into units.
#[derive(Clone, Copy)]
struct Sizes {
    num_images: usize,
    channels: usize,
    pixels: usize,
    groups: usize,
}

impl Sizes {
    fn new([num_images, channels, height, width]: [usize; 4], params: &GroupNormParams) -> Self {
        Self { num_images, channels, pixels: height * width, groups: params.num_groups }
    }

    fn chunks(&self) -> usize {
        self.pixels.div_ceil(CHUNK)
    }

    fn units(&self) -> usize {
        self.num_images * self.chunks()
    }

    /// Image of a unit, and its range of elements.
    fn unit(&self, unit: usize) -> (usize, std::ops::Range<usize>) {
        let (image, chunk) = (unit / self.chunks(), unit % self.chunks());
        let pixels = chunk * CHUNK..self.pixels.min((chunk + 1) * CHUNK);
        let first = image * self.pixels;
        (image, (first + pixels.start) * self.channels..(first + pixels.end) * self.channels)
    }

    fn group_of(&self, channel: usize) -> usize {
        channel / (self.channels / self.groups)
    }

    /// Number of values of a group.
    fn group_len(&self) -> f64 {
        (self.channels / self.groups * self.pixels) as f64
    }
}

/// The normalised maps, and the statistics the backward pass needs.
pub(crate) fn forward(
    isa: Isa,
    x: &[f32],
    shape: [usize; 4],
    gamma: &[f32],
    beta: &[f32],
    residual: Option<&[f32]>,
    params: &GroupNormParams,
) -> (Vec<f32>, Statistics) {
    let sizes = Sizes::new(shape, params);
    let channels = sizes.channels;
    let pivot = |image: usize| &x[image * sizes.pixels * channels..][..channels];
    let sums = sum_units(&sizes, |image, range, [first, second]| {
        add_moments(isa, &x[range], pivot(image), first, second);
    });
    let statistics: Statistics = (0..sizes.num_images * sizes.groups)
        .map(|at| {
            let (image, group) = (at / sizes.groups, at % sizes.groups);
            let members = (0..channels).filter(|&channel| sizes.group_of(channel) == group);
            let moments = members.map(|channel| {
                let [first, second] = sums[image * channels + channel];
                (f64::from(pivot(image)[channel]), first / sizes.pixels as f64, second)
            });
            let count = (channels / sizes.groups) as f64;
            let mean = moments.clone().map(|(pivot, shift, _)| pivot + shift).sum::<f64>() / count;
            let squares: f64 = moments
                .map(|(pivot, shift, second)| {
                    let pixels = sizes.pixels as f64;
                    // The squares around the channel's mean, plus those of the channel's mean around the group's mean.
                    second - pixels * shift * shift + pixels * (pivot + shift - mean).powi(2)
                })
                .sum();
            // Rounding must not make the variance negative; a NaN stays NaN.
            let variance = squares / sizes.group_len();
            let variance = if variance < 0.0 { 0.0 } else { variance };
            [mean as f32, (1.0 / (variance + f64::from(params.epsilon)).sqrt()) as f32]
        })
        .collect();

    let output = Output::new(x.len());
    let affine = affine_of_images(&sizes, &statistics, gamma);
    for_each_unit(sizes.units(), |unit| {
        let (image, range) = sizes.unit(unit);
        // SAFETY: every unit has its own pixels.
        let target = unsafe { output.range(range.start, range.len()) };
        let [mean, scale] = &affine[image];
        let x = &x[range.clone()];
        let affine = [&mean[..], scale, beta];
        match (residual, params.activation) {
            (None, Activation::Identity) => normalise(isa, target, x, affine),
            (None, Activation::Relu) => normalise_relu(isa, target, x, affine),
            (Some(residual), Activation::Identity) => normalise_add(isa, target, x, affine, &residual[range]),
            (Some(residual), Activation::Relu) => normalise_add_relu(isa, target, x, affine, &residual[range]),
        }
    });
    // SAFETY: the units together are all of the output.
    (unsafe { output.into_vec() }, statistics)
}

/// Gradients of a group normalisation.
pub(crate) struct GroupNormGrads {
    pub(crate) x: Vec<f32>,
    pub(crate) gamma: Vec<f32>,
    pub(crate) beta: Vec<f32>,
    /// The gradient of the output at values that the ReLU passed, which is the gradient of the residual; `None`
    /// without a ReLU.
    pub(crate) masked: Option<Vec<f32>>,
}

/// The gradients, from the output's gradient and the output itself.
pub(crate) fn backward(
    isa: Isa,
    [output_grad, output]: [&[f32]; 2],
    x: &[f32],
    shape: [usize; 4],
    gamma: &[f32],
    statistics: &[[f32; 2]],
    params: &GroupNormParams,
) -> GroupNormGrads {
    let sizes = Sizes::new(shape, params);
    let channels = sizes.channels;
    let affine = affine_of_images(&sizes, statistics, gamma);
    let masked = match params.activation {
        Activation::Identity => None,
        Activation::Relu => Some(Output::new(x.len())),
    };
    // Σ g and Σ g·(x − mean) of every image and channel.
    let sums = sum_units(&sizes, |image, range, [of_g, of_gx]| {
        let mean = &affine[image][0];
        let Some(masked) = &masked else {
            add_grads(isa, &output_grad[range.clone()], &x[range], mean, of_g, of_gx);
            return;
        };
        // SAFETY: every unit has its own pixels.
        let target = unsafe { masked.range(range.start, range.len()) };
        mask(isa, target, &output_grad[range.clone()], &output[range.clone()]);
        // SAFETY: written just now.
        let g = unsafe { std::slice::from_raw_parts(target.as_ptr().cast::<f32>(), range.len()) };
        add_grads(isa, g, &x[range], mean, of_g, of_gx);
    });
    // SAFETY: the units together are all of the output.
    let masked = masked.map(|masked| unsafe { masked.into_vec() });
    let g = masked.as_deref().unwrap_or(output_grad);

    // grad_x = scale·g + slope·(x − mean) + constant
    let mut slopes = vec![0.0_f32; sizes.num_images * channels];
    let mut constants = vec![0.0_f32; sizes.num_images * channels];
    let mut gamma_grad = vec![0.0_f64; channels];
    let mut beta_grad = vec![0.0_f64; channels];
    for image in 0..sizes.num_images {
        let of_image = &sums[image * channels..(image + 1) * channels];
        let mut means = vec![[0.0_f64; 2]; sizes.groups];
        for (channel, &[of_g, of_gx]) in of_image.iter().enumerate() {
            let group = sizes.group_of(channel);
            let inverse = f64::from(statistics[image * sizes.groups + group][1]);
            beta_grad[channel] += of_g;
            gamma_grad[channel] += of_gx * inverse;
            means[group][0] += f64::from(gamma[channel]) * of_g / sizes.group_len();
            means[group][1] += f64::from(gamma[channel]) * of_gx * inverse / sizes.group_len();
        }
        for channel in 0..channels {
            let group = sizes.group_of(channel);
            let inverse = f64::from(statistics[image * sizes.groups + group][1]);
            slopes[image * channels + channel] = (-inverse * inverse * means[group][1]) as f32;
            constants[image * channels + channel] = (-inverse * means[group][0]) as f32;
        }
    }
    let grad = Output::new(x.len());
    for_each_unit(sizes.units(), |unit| {
        let (image, range) = sizes.unit(unit);
        // SAFETY: every unit has its own pixels.
        let target = unsafe { grad.range(range.start, range.len()) };
        let of_image = image * channels..(image + 1) * channels;
        let group = [&slopes[of_image.clone()], &constants[of_image]];
        let [mean, scale] = &affine[image];
        combine(isa, target, &g[range.clone()], &x[range], [mean, scale], group);
    });
    let to_f32 = |values: Vec<f64>| values.into_iter().map(|value| value as f32).collect();
    GroupNormGrads {
        // SAFETY: the units together are all of the input.
        x: unsafe { grad.into_vec() },
        gamma: to_f32(gamma_grad),
        beta: to_f32(beta_grad),
        masked,
    }
}

/// Mean and `gamma / σ` of every image's channels.
fn affine_of_images(sizes: &Sizes, statistics: &[[f32; 2]], gamma: &[f32]) -> Vec<[Vec<f32>; 2]> {
    let of_image = |image: usize| {
        let statistic = |channel: usize| statistics[image * sizes.groups + sizes.group_of(channel)];
        let mean = (0..sizes.channels).map(|channel| statistic(channel)[0]).collect();
        let scale = (0..sizes.channels).map(|channel| gamma[channel] * statistic(channel)[1]).collect();
        [mean, scale]
    };
    (0..sizes.num_images).map(of_image).collect()
}

/// Two sums for every image and channel, from units added in order.
fn sum_units(
    sizes: &Sizes,
    add: impl Fn(usize, std::ops::Range<usize>, [&mut [f32]; 2]) + Sync + Send,
) -> Vec<[f64; 2]> {
    let channels = sizes.channels;
    let mut partial = Scratch::take(sizes.units() * 2 * channels);
    let shared = SharedSlice::new(&mut partial);
    for_each_unit(sizes.units(), |unit| {
        // SAFETY: every unit has its own sums.
        let sums = unsafe { shared.range(unit * 2 * channels, 2 * channels) };
        sums.fill(0.0);
        let (first, second) = sums.split_at_mut(channels);
        let (image, range) = sizes.unit(unit);
        add(image, range, [first, second]);
    });
    let mut total = vec![[0.0_f64; 2]; sizes.num_images * channels];
    for (unit, sums) in partial.chunks_exact(2 * channels).enumerate() {
        let (image, _) = sizes.unit(unit);
        let (first, second) = sums.split_at(channels);
        for (channel, total) in total[image * channels..(image + 1) * channels].iter_mut().enumerate() {
            total[0] += f64::from(first[channel]);
            total[1] += f64::from(second[channel]);
        }
    }
    total
}

widest! {
    fn add_moments(x: &[f32], pivot: &[f32], first: &mut [f32], second: &mut [f32]) -> () {
        let channels = pivot.len();
        let (first, second) = (&mut first[..channels], &mut second[..channels]);
        for x in x.chunks_exact(channels) {
            for c in 0..channels {
                let x = x[c] - pivot[c];
                first[c] += x;
                second[c] += x * x;
            }
        }
    }
}

widest! {
    fn add_grads(g: &[f32], x: &[f32], mean: &[f32], of_g: &mut [f32], of_gx: &mut [f32]) -> () {
        let channels = mean.len();
        let (of_g, of_gx) = (&mut of_g[..channels], &mut of_gx[..channels]);
        for (g, x) in g.chunks_exact(channels).zip(x.chunks_exact(channels)) {
            for c in 0..channels {
                of_g[c] += g[c];
                of_gx[c] += g[c] * (x[c] - mean[c]);
            }
        }
    }
}

/// Writes `value(channel)` for every pixel of `target`, with the pixel's run of each of the `maps` available.
///
/// All slices are limited to the number of channels, so that the loop over them has no bounds checks.
macro_rules! along_channels {
    ($target:ident, $channels:ident, [$($map:ident),*], [$($vector:ident),*], |$channel:ident| $value:expr) => {
        $(let $vector = &$vector[..$channels];)*
        for (pixel, target) in $target.chunks_exact_mut($channels).enumerate() {
            let target = &mut target[..$channels];
            $(let $map = &$map[pixel * $channels..][..$channels];)*
            for $channel in 0..$channels {
                target[$channel].write($value);
            }
        }
    };
}

widest! {
    fn normalise(target: &mut [MaybeUninit<f32>], x: &[f32], affine: [&[f32]; 3]) -> () {
        let [mean, scale, beta] = affine;
        let channels = mean.len();
        along_channels!(target, channels, [x], [mean, scale, beta], |c| scale[c] * (x[c] - mean[c]) + beta[c]);
    }
}

widest! {
    fn normalise_relu(target: &mut [MaybeUninit<f32>], x: &[f32], affine: [&[f32]; 3]) -> () {
        let [mean, scale, beta] = affine;
        let channels = mean.len();
        along_channels!(target, channels, [x], [mean, scale, beta], |c| {
            relu(scale[c] * (x[c] - mean[c]) + beta[c])
        });
    }
}

widest! {
    fn normalise_add(target: &mut [MaybeUninit<f32>], x: &[f32], affine: [&[f32]; 3], residual: &[f32]) -> () {
        let [mean, scale, beta] = affine;
        let channels = mean.len();
        along_channels!(target, channels, [x, residual], [mean, scale, beta], |c| {
            scale[c] * (x[c] - mean[c]) + beta[c] + residual[c]
        });
    }
}

widest! {
    fn normalise_add_relu(target: &mut [MaybeUninit<f32>], x: &[f32], affine: [&[f32]; 3], residual: &[f32]) -> () {
        let [mean, scale, beta] = affine;
        let channels = mean.len();
        along_channels!(target, channels, [x, residual], [mean, scale, beta], |c| {
            relu(scale[c] * (x[c] - mean[c]) + beta[c] + residual[c])
        });
    }
}

/// ReLU, written so that a NaN stays NaN.
#[inline(always)]
fn relu(value: f32) -> f32 {
    if value <= 0.0 { 0.0 } else { value }
}

widest! {
    fn mask(target: &mut [MaybeUninit<f32>], grad: &[f32], output: &[f32]) -> () {
        for ((target, grad), output) in target.iter_mut().zip(grad).zip(output) {
            target.write(if *output <= 0.0 { 0.0 } else { *grad });
        }
    }
}

widest! {
    fn combine(
        target: &mut [MaybeUninit<f32>],
        g: &[f32],
        x: &[f32],
        affine: [&[f32]; 2],
        group: [&[f32]; 2],
    ) -> () {
        let ([mean, scale], [slope, constant]) = (affine, group);
        let channels = mean.len();
        along_channels!(target, channels, [g, x], [mean, scale, slope, constant], |c| {
            scale[c] * g[c] + slope[c] * (x[c] - mean[c]) + constant[c]
        });
    }
}
