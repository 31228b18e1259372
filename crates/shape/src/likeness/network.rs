//! The network's weights and its output for a pair. It needs no machine learning library: nine million
//! multiplications in plain loops.

use std::sync::LazyLock;

use pulp::{Arch, Simd, WithSimd};
use safetensors::SafeTensors;

use super::pair::{NUM_CHANNELS, SIDE};
use crate::error::ShapeError;
use crate::layers::{Layer, Linear, answered, convolved, layer, pooled};

/// The convolutions: from 64 pixels per side to 32, 16, 16, 8, 8 and 4.
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
/// Hidden units between the pooled values and the output.
pub const NUM_HIDDEN: usize = 64;

/// Weights of the network.
#[derive(Debug, Clone)]
pub struct LikenessNetwork {
    convolutions: Vec<Linear>,
    hidden: Linear,
    answer: Linear,
}

static SHIPPED: LazyLock<LikenessNetwork> = LazyLock::new(|| {
    LikenessNetwork::read(include_bytes!("../../likeness.safetensors"))
        .expect("the shipped weights are read by a test of this module")
});

impl LikenessNetwork {
    /// The shipped weights.
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

    /// ln of the odds that the pair shows one part; `values` as [`super::Pair::values`] gives them.
    pub fn log_odds(&self, values: &[f32]) -> f32 {
        Arch::new().dispatch(Forward { network: self, values })
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
        answered::<NUM_HIDDEN>(&pooled::<{ NUM_POOLED / 2 }>(&map), &network.hidden, &network.answer)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
