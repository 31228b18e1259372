//! Random numbers by index: every sample has its own generator, derived from (seed, stream, index).

use rand::Rng;
use rand_pcg::Pcg64Mcg;

use crate::random::generator_at;
pub(crate) use crate::random::scramble;

/// The generator of one sample.
pub(crate) type SampleRng = Pcg64Mcg;

/// Separate streams of one seed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Stream {
    /// Training samples.
    Training = 1,
    /// Samples for validation.
    HeldOut = 2,
    /// Values drawn once, when the augmenter is made.
    Preparation = 3,
    /// Values drawn once for other parts.
    OtherParts = 4,
}

/// The generator of sample `index`, the same in any order of calls.
pub(crate) fn sample_rng(seed: u64, stream: Stream, index: u64) -> SampleRng {
    generator_at(seed, stream as u64, index)
}

/// Uniform in `[low, high)`, or `low` if the two are equal.
pub(crate) fn uniform(rng: &mut SampleRng, low: f32, high: f32) -> f32 {
    low + (high - low) * rng.random::<f32>()
}

/// A factor between `low` and `high`, as often above as below their geometric mean.
pub(crate) fn log_uniform(rng: &mut SampleRng, low: f32, high: f32) -> f32 {
    uniform(rng, low.ln(), high.ln()).exp()
}

/// True with probability `p`.
pub(crate) fn chance(rng: &mut SampleRng, p: f32) -> bool {
    rng.random::<f32>() < p
}

/// A whole number in `0..count`, drawn as 32 bits so that 32-bit targets draw the same.
pub(crate) fn index_below(rng: &mut SampleRng, count: usize) -> usize {
    rng.random_range(0..count as u32) as usize
}

/// A direction, as (cos, sin).
pub(crate) fn direction(rng: &mut SampleRng) -> [f32; 2] {
    let angle = uniform(rng, 0.0, std::f32::consts::TAU);
    [angle.cos(), angle.sin()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_give_different_and_repeatable_generators() {
        let draw = |seed, stream, index| sample_rng(seed, stream, index).random::<u64>();
        assert_eq!(draw(1, Stream::Training, 5), draw(1, Stream::Training, 5));
        let mut seen = std::collections::BTreeSet::new();
        for seed in 0..10 {
            for index in 0..10 {
                for stream in [Stream::Training, Stream::HeldOut, Stream::Preparation] {
                    assert!(seen.insert(draw(seed, stream, index)), "seed {seed}, index {index}");
                }
            }
        }
    }
}
