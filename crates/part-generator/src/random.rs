//! Random numbers by index: every part, photo and sample has its own generator.

use rand::Rng;
use rand_pcg::Pcg64Mcg;
use sdg_demonstration::random::generator_at;
pub(crate) use sdg_demonstration::random::scramble;

/// Purpose of a generator; generators of different streams are independent.
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
    /// A covering object.
    Others = 6,
    /// Tiles of noise shared by all pictures.
    Tiles = 7,
    /// A sample of several parts.
    MixedSample = 8,
}

/// The generator of item `index` of a stream of a seed.
pub(crate) fn generator(seed: u64, stream: Stream, index: u64) -> Pcg64Mcg {
    generator_at(seed, stream as u64, index)
}

/// The distributions that this crate uses, in single precision.
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

    /// An integer from `low` to `high`, both included.
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
