//! Convolutions and sums of small networks in plain loops. They are compiled for the widest instructions of the machine
//! if their caller is.

use safetensors::SafeTensors;

use crate::error::ShapeError;
use crate::lanes::larger;

/// A convolution of 3×3 pixels with zero padding, followed by a rectifier.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Layer {
    /// Input channels.
    pub inputs: usize,
    /// Output channels.
    pub outputs: usize,
    /// Stride in pixels.
    pub stride: usize,
}

pub(crate) const fn layer(inputs: usize, outputs: usize, stride: usize) -> Layer {
    Layer { inputs, outputs, stride }
}

/// Weights by tap, input and output; and the bias.
#[derive(Debug, Clone)]
pub(crate) struct Linear {
    pub(crate) weights: Vec<f32>,
    pub(crate) bias: Vec<f32>,
}

impl Linear {
    pub(crate) fn read(file: &SafeTensors<'_>, name: &str, shape: &[usize]) -> Result<Self, ShapeError> {
        let weights = tensor(file, &format!("{name}.weight"), shape)?;
        let bias = tensor(file, &format!("{name}.bias"), &shape[..1])?;
        Ok(Self { weights: outputs_last(&weights, shape[0], shape[1]), bias })
    }
}

/// Reorders weights from (output, input, tap) to (tap, input, output), so that the summing loops read adjacent outputs.
fn outputs_last(weights: &[f32], outputs: usize, inputs: usize) -> Vec<f32> {
    let taps = weights.len() / (outputs * inputs);
    let place = |i: usize| {
        let (output, rest) = (i % outputs, i / outputs);
        let (input, tap) = (rest % inputs, rest / inputs);
        (output * inputs + input) * taps + tap
    };
    (0..weights.len()).map(|i| weights[place(i)]).collect()
}

fn tensor(file: &SafeTensors<'_>, name: &str, shape: &[usize]) -> Result<Vec<f32>, ShapeError> {
    let wrong = |found: String| ShapeError::Weights(format!("expected {name} of shape {shape:?}, found {found}"));
    let view = file.tensor(name).map_err(|error| wrong(error.to_string()))?;
    if view.shape() != shape {
        return Err(wrong(format!("{:?}", view.shape())));
    }
    match view.dtype() {
        safetensors::Dtype::F16 => {
            Ok(view.data().chunks_exact(2).map(|pair| half::f16::from_le_bytes([pair[0], pair[1]]).to_f32()).collect())
        }
        safetensors::Dtype::F32 => Ok(view
            .data()
            .chunks_exact(4)
            .map(|four| f32::from_le_bytes([four[0], four[1], four[2], four[3]]))
            .collect()),
        other => Err(wrong(format!("elements of {other:?}"))),
    }
}

/// Pixels of a row that are summed together: the sums stay in registers, and a weight is read once for all these
/// pixels. Chosen for time.
const PIXELS: usize = 4;
/// Output channels that are summed together. Chosen for time.
const CHANNELS: usize = 16;

/// One convolution and its rectifier. Every sum has the order of its definition: tap by tap, input by input.
#[inline(always)]
pub(crate) fn convolved<const OUTPUTS: usize>(
    map: &[f32],
    side: usize,
    layer: &Layer,
    convolution: &Linear,
) -> Vec<f32> {
    const { assert!(OUTPUTS.is_multiple_of(CHANNELS / 2), "channels are summed by sixteen or eight") };
    let (inputs, out_side) = (layer.inputs, side / layer.stride);
    let padded = Padded::new(map, side, inputs);
    let mut out = vec![0.0; out_side * out_side * OUTPUTS];
    for (y, row) in out.chunks_exact_mut(out_side * OUTPUTS).enumerate() {
        for (block, out) in row.chunks_mut(PIXELS * OUTPUTS).enumerate() {
            let at = |tap: usize, pixel: usize| {
                // Pixels of a block beyond the row's end are not kept.
                let x = (block * PIXELS + pixel).min(out_side - 1);
                padded.pixel(x * layer.stride + tap % 3, y * layer.stride + tap / 3)
            };
            for channel in (0..OUTPUTS).step_by(CHANNELS) {
                if OUTPUTS - channel >= CHANNELS {
                    sum_block::<CHANNELS, OUTPUTS>(convolution, channel, at, out);
                } else {
                    sum_block::<{ CHANNELS / 2 }, OUTPUTS>(convolution, channel, at, out);
                }
            }
        }
    }
    out
}

/// Computes `COUNT` channels of a block of pixels.
#[inline(always)]
fn sum_block<'a, const COUNT: usize, const OUTPUTS: usize>(
    convolution: &Linear,
    channel: usize,
    at: impl Fn(usize, usize) -> &'a [f32],
    out: &mut [f32],
) {
    let mut bias = [0.0; COUNT];
    bias.copy_from_slice(&convolution.bias[channel..][..COUNT]);
    let mut sums = [bias; PIXELS];
    for tap in 0..9 {
        let pixels: [&[f32]; PIXELS] = std::array::from_fn(|pixel| at(tap, pixel));
        let inputs = pixels[0].len();
        let weights = convolution.weights[tap * inputs * OUTPUTS..][..inputs * OUTPUTS].chunks_exact(OUTPUTS);
        for (input, weights) in weights.enumerate() {
            let mut row = [0.0; COUNT];
            row.copy_from_slice(&weights[channel..][..COUNT]);
            for (sums, pixel) in sums.iter_mut().zip(&pixels) {
                for (sum, weight) in sums.iter_mut().zip(&row) {
                    *sum += pixel[input] * weight;
                }
            }
        }
    }
    for (out, sums) in out.chunks_exact_mut(OUTPUTS).zip(sums) {
        out[channel..][..COUNT].copy_from_slice(&sums.map(rectified));
    }
}

/// A map with a border of zeros, one pixel wide.
struct Padded {
    values: Vec<f32>,
    across: usize,
    channels: usize,
}

impl Padded {
    #[inline(always)]
    fn new(map: &[f32], side: usize, channels: usize) -> Self {
        let across = side + 2;
        let mut values = vec![0.0; across * across * channels];
        for (row, out) in map.chunks_exact(side * channels).zip(values.chunks_exact_mut(across * channels).skip(1)) {
            out[channels..][..side * channels].copy_from_slice(row);
        }
        Self { values, across, channels }
    }

    #[inline(always)]
    fn pixel(&self, x: usize, y: usize) -> &[f32] {
        &self.values[(y * self.across + x) * self.channels..][..self.channels]
    }
}

/// Adds values times weights to the sums.
#[inline(always)]
pub(crate) fn add_products<const OUTPUTS: usize>(sums: &mut [f32; OUTPUTS], values: &[f32], weights: &[f32]) {
    for (value, row) in values.iter().zip(weights.chunks_exact(OUTPUTS)) {
        for (sum, weight) in sums.iter_mut().zip(row) {
            *sum += value * weight;
        }
    }
}

/// Means of the channels over all pixels, then maxima.
#[inline(always)]
pub(crate) fn pooled<const CHANNELS: usize>(map: &[f32]) -> Vec<f32> {
    let count = (map.len() / CHANNELS) as f32;
    let mut pooled = vec![0.0; 2 * CHANNELS];
    let (mean, max) = pooled.split_at_mut(CHANNELS);
    for pixel in map.chunks_exact(CHANNELS) {
        for c in 0..CHANNELS {
            mean[c] += pixel[c] / count;
            max[c] = larger(pixel[c], max[c]);
        }
    }
    pooled
}

/// One value from many, through `HIDDEN` rectified units.
#[inline(always)]
pub(crate) fn answered<const HIDDEN: usize>(values: &[f32], hidden: &Linear, answer: &Linear) -> f32 {
    let mut units = [0.0; HIDDEN];
    units.copy_from_slice(&hidden.bias);
    add_products(&mut units, values, &hidden.weights);
    let mut sum = [answer.bias[0]];
    add_products(&mut sum, &units.map(rectified), &answer.weights);
    sum[0]
}

#[inline(always)]
fn rectified(value: f32) -> f32 {
    larger(value, 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};
    use rand_pcg::Pcg64Mcg;

    fn random(len: usize, rng: &mut Pcg64Mcg) -> Vec<f32> {
        (0..len).map(|_| rng.random_range(-1.0..1.0)).collect()
    }

    /// Computes each value by the definition, in double precision.
    fn naive(map: &[f32], side: usize, layer: &Layer, convolution: &Linear) -> Vec<f64> {
        let out_side = side / layer.stride;
        let mut out = vec![0.0; out_side * out_side * layer.outputs];
        for (i, value) in out.iter_mut().enumerate() {
            *value = f64::from(convolution.bias[i % layer.outputs]);
            let (o, x, y) = (i % layer.outputs, i / layer.outputs % out_side, i / layer.outputs / out_side);
            for (tap, input) in (0..9).flat_map(|tap| (0..layer.inputs).map(move |input| (tap, input))) {
                let column = (x * layer.stride + tap % 3) as isize - 1;
                let row = (y * layer.stride + tap / 3) as isize - 1;
                if (0..side as isize).contains(&column) && (0..side as isize).contains(&row) {
                    let at = (row as usize * side + column as usize) * layer.inputs + input;
                    let weight = convolution.weights[(tap * layer.inputs + input) * layer.outputs + o];
                    *value += f64::from(map[at]) * f64::from(weight);
                }
            }
            *value = value.max(0.0);
        }
        out
    }

    /// Whole blocks of pixels and channels, and rows and channels that end within a block.
    #[test]
    fn a_convolution_is_what_its_definition_says() {
        let rng = &mut Pcg64Mcg::seed_from_u64(2);
        for (stride, side) in [(1, 8), (2, 8), (1, 6), (2, 6)] {
            check::<16>(stride, side, rng);
            check::<24>(stride, side, rng);
            check::<48>(stride, side, rng);
        }
    }

    fn check<const OUTPUTS: usize>(stride: usize, side: usize, rng: &mut Pcg64Mcg) {
        let layer = Layer { inputs: 5, outputs: OUTPUTS, stride };
        let convolution = Linear { weights: random(9 * 5 * OUTPUTS, rng), bias: random(OUTPUTS, rng) };
        let map = random(side * side * 5, rng);
        let made = convolved::<OUTPUTS>(&map, side, &layer, &convolution);
        let expected = naive(&map, side, &layer, &convolution);
        assert_eq!(made.len(), expected.len());
        for (a, b) in made.iter().zip(&expected) {
            assert!((f64::from(*a) - b).abs() < 1e-4, "{OUTPUTS} channels, {side} pixels by {stride}: {a} {b}");
        }
    }
}
