//! Random numbers by address: every part, photo and sample has a generator of its own.

use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

/// What a generator is for; generators of different streams are independent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Stream {
    /// The recipe of a part.
    Recipe = 1,
    /// A look-alike.
    LookAlike = 3,
    /// A photo for a demonstration.
    Photo = 4,
    /// A sample of a scene.
    Sample = 5,
    /// The pool of other parts.
    Others = 6,
    /// Tiles of noise that all pictures share.
    Tiles = 7,
}

/// The generator of item `index` of a stream of a seed.
pub(crate) fn generator(seed: u64, stream: Stream, index: u64) -> Pcg64Mcg {
    let first = scramble(seed ^ scramble(stream as u64 ^ scramble(index)));
    let second = scramble(first ^ index);
    let mut state = [0u8; 16];
    state[..8].copy_from_slice(&first.to_le_bytes());
    state[8..].copy_from_slice(&second.to_le_bytes());
    Pcg64Mcg::from_seed(state)
}

/// A bijection of 64 bits that separates neighbouring values.
///
/// # Source
/// Steele, Lea and Flood 2014, the output function of SplitMix64.
pub(crate) fn scramble(value: u64) -> u64 {
    let z = value.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// The draws that the generator needs, in single precision.
pub(crate) trait Draw: Rng {
    /// Uniform in `[low, high)`.
    fn uniform(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.random::<f32>()
    }

    /// Uniform in the logarithm.
    fn log_uniform(&mut self, low: f32, high: f32) -> f32 {
        self.uniform(low.ln(), high.ln()).exp()
    }

    /// True with probability `p`.
    fn chance(&mut self, p: f32) -> bool {
        self.random::<f32>() < p
    }

    /// A whole number from `low` to `high`, both included.
    fn whole(&mut self, low: usize, high: usize) -> usize {
        self.random_range(low as u32..=high as u32) as usize
    }

    /// An angle in `[0, 2π)`.
    fn angle(&mut self) -> f32 {
        self.uniform(0.0, std::f32::consts::TAU)
    }

    /// -1 or 1.
    fn sign(&mut self) -> f32 {
        if self.chance(0.5) { 1.0 } else { -1.0 }
    }
}

impl<R: Rng> Draw for R {}
