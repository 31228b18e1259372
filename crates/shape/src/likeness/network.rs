//! The network's weights and what it makes of a pair. No machine learning library is needed for that: nine million
//! multiplications in plain loops.

use std::sync::LazyLock;

use pulp::{Arch, Simd, WithSimd};
use safetensors::SafeTensors;

use super::pair::{NUM_CHANNELS, SIDE};
use crate::error::ShapeError;

/// A convolution of 3×3 pixels, with a border of zeros, and a rectifier behind it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Layer {
    /// Channels that it reads.
    pub inputs: usize,
    /// Channels that it makes: 16, 32 or 64.
    pub outputs: usize,
    /// Pixels from one place to the next.
    pub stride: usize,
}

const fn layer(inputs: usize, outputs: usize, stride: usize) -> Layer {
    Layer { inputs, outputs, stride }
}

/// The convolutions: 64, 32, 16, 16, 8, 8 and 4 pixels a side.
pub const LAYERS: [Layer; 6] = [
    layer(NUM_CHANNELS, 16, 2),
    layer(16, 32, 2),
    layer(32, 32, 1),
    layer(32, 64, 2),
    layer(64, 64, 1),
    layer(64, 64, 2),
];
/// Mean and maximum of the last convolution's channels.
const NUM_POOLED: usize = 2 * LAYERS[LAYERS.len() - 1].outputs;
/// Units between those and the answer.
pub const NUM_HIDDEN: usize = 64;

/// Weights of the network.
#[derive(Debug, Clone)]
pub struct LikenessNetwork {
    convolutions: Vec<Linear>,
    hidden: Linear,
    answer: Linear,
}

/// Weights by what is read, then by what is made; and what is added.
#[derive(Debug, Clone)]
struct Linear {
    weights: Vec<f32>,
    bias: Vec<f32>,
}

static SHIPPED: LazyLock<LikenessNetwork> = LazyLock::new(|| {
    LikenessNetwork::read(include_bytes!("../../likeness.safetensors"))
        .expect("the shipped weights are read by a test of this module")
});

impl LikenessNetwork {
    /// The one trained by us.
    pub fn shipped() -> &'static Self {
        &SHIPPED
    }

    /// Reads a safetensors file of half or single precision: `convolution.N.weight` of outputs × inputs × 3 × 3,
    /// `hidden.weight` and `answer.weight` of outputs × inputs, and a `.bias` for each.
    ///
    /// # Errors
    /// [`ShapeError::Weights`] for any other file.
    pub fn read(bytes: &[u8]) -> Result<Self, ShapeError> {
        let file = SafeTensors::deserialize(bytes).map_err(|error| ShapeError::Weights(error.to_string()))?;
        let mut convolutions = Vec::new();
        for (idx, Layer { inputs, outputs, .. }) in LAYERS.iter().enumerate() {
            convolutions.push(Linear::read(&file, &format!("convolution.{idx}"), &[*outputs, *inputs, 3, 3])?);
        }
        Ok(Self {
            convolutions,
            hidden: Linear::read(&file, "hidden", &[NUM_HIDDEN, NUM_POOLED])?,
            answer: Linear::read(&file, "answer", &[1, NUM_HIDDEN])?,
        })
    }

    /// ln of how much likelier the pair is to show one part than not; `values` as [`super::Pair::values`] gives them.
    pub fn log_odds(&self, values: &[f32]) -> f32 {
        Arch::new().dispatch(Forward { network: self, values })
    }
}

impl Linear {
    fn read(file: &SafeTensors<'_>, name: &str, shape: &[usize]) -> Result<Self, ShapeError> {
        let weights = tensor(file, &format!("{name}.weight"), shape)?;
        let bias = tensor(file, &format!("{name}.bias"), &shape[..1])?;
        Ok(Self { weights: outputs_last(&weights, shape[0], shape[1]), bias })
    }
}

/// From output, input, tap to tap, input, output: outputs lie next to each other where the loops add them up.
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

struct Forward<'a> {
    network: &'a LikenessNetwork,
    values: &'a [f32],
}

impl WithSimd for Forward<'_> {
    type Output = f32;

    /// Plain loops, compiled for the widest instructions that the machine has.
    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> f32 {
        let Self { network, values } = self;
        let (mut map, mut side) = (values.to_vec(), SIDE);
        for (layer, convolution) in LAYERS.iter().zip(&network.convolutions) {
            map = match layer.outputs {
                16 => convolved::<16>(&map, side, layer, convolution),
                32 => convolved::<32>(&map, side, layer, convolution),
                _ => convolved::<64>(&map, side, layer, convolution),
            };
            side /= layer.stride;
        }
        let num = NUM_POOLED / 2;
        let mut pooled = vec![0.0; NUM_POOLED];
        let (mean, max) = pooled.split_at_mut(num);
        for pixel in map.chunks_exact(num) {
            for c in 0..num {
                mean[c] += pixel[c] / (side * side) as f32;
                max[c] = f32::max(max[c], pixel[c]);
            }
        }
        let mut hidden = [0.0; NUM_HIDDEN];
        hidden.copy_from_slice(&network.hidden.bias);
        add_products(&mut hidden, &pooled, &network.hidden.weights);
        let mut answer = [network.answer.bias[0]];
        add_products(&mut answer, &hidden.map(rectified), &network.answer.weights);
        answer[0]
    }
}

/// One convolution and its rectifier.
#[inline(always)]
fn convolved<const OUTPUTS: usize>(map: &[f32], side: usize, layer: &Layer, convolution: &Linear) -> Vec<f32> {
    let (inputs, stride) = (layer.inputs, layer.stride);
    let out_side = side / stride;
    let mut out = Vec::with_capacity(out_side * out_side * OUTPUTS);
    for i in 0..out_side * out_side {
        let [x, y] = [i % out_side, i / out_side].map(|k| k * stride);
        let mut sums = [0.0; OUTPUTS];
        sums.copy_from_slice(&convolution.bias);
        for tap in 0..9 {
            // The border is zero.
            let [x, y] = [x + tap % 3, y + tap / 3].map(|k| k.wrapping_sub(1));
            if x < side && y < side {
                let pixel = &map[(y * side + x) * inputs..][..inputs];
                add_products(&mut sums, pixel, &convolution.weights[tap * inputs * OUTPUTS..][..inputs * OUTPUTS]);
            }
        }
        out.extend(sums.map(rectified));
    }
    out
}

/// Adds values times weights to the sums.
#[inline(always)]
fn add_products<const OUTPUTS: usize>(sums: &mut [f32; OUTPUTS], values: &[f32], weights: &[f32]) {
    for (value, row) in values.iter().zip(weights.chunks_exact(OUTPUTS)) {
        for (sum, weight) in sums.iter_mut().zip(row) {
            *sum += value * weight;
        }
    }
}

#[inline(always)]
fn rectified(value: f32) -> f32 {
    value.max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};
    use rand_pcg::Pcg64Mcg;

    fn random(len: usize, rng: &mut Pcg64Mcg) -> Vec<f32> {
        (0..len).map(|_| rng.random_range(-1.0..1.0)).collect()
    }

    /// By the definitions, one value at a time, in double precision.
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

    #[test]
    fn a_convolution_is_what_its_definition_says() {
        let rng = &mut Pcg64Mcg::seed_from_u64(2);
        for stride in [1, 2] {
            let layer = Layer { inputs: 5, outputs: 16, stride };
            let convolution = Linear { weights: random(9 * 5 * 16, rng), bias: random(16, rng) };
            let map = random(8 * 8 * 5, rng);
            let made = convolved::<16>(&map, 8, &layer, &convolution);
            let expected = naive(&map, 8, &layer, &convolution);
            assert_eq!(made.len(), expected.len());
            for (a, b) in made.iter().zip(&expected) {
                assert!((f64::from(*a) - b).abs() < 1e-4, "{a} {b}");
            }
        }
    }

    /// The expected values are PyTorch's, in double precision with the shipped weights.
    #[test]
    fn the_shipped_network_answers_as_pytorch_does() {
        for (seed, expected) in [(13, 4.815_796), (500, 2.684_056)] {
            let value = |i: usize| ((i * 7919 + seed * (i / 512)) % 1000) as f32 / 1000.0;
            let values: Vec<f32> = (0..SIDE * SIDE * NUM_CHANNELS).map(value).collect();
            let log_odds = LikenessNetwork::shipped().log_odds(&values);
            assert!((log_odds - expected).abs() < 1e-3, "{log_odds}, expected {expected}");
        }
    }

    #[test]
    fn other_files_are_refused() {
        let other = LikenessNetwork::read(b"no such file").unwrap_err();
        assert!(matches!(other, ShapeError::Weights(_)), "{other}");
    }
}
