//! Random numbers by index: a separate generator for each (seed, stream, index), independent of the order of calls.

use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;

/// The generator of item `index` of a stream of a seed; streams of one seed are independent.
pub fn generator_at(seed: u64, stream: u64, index: u64) -> Pcg64Mcg {
    let first = scramble(seed ^ scramble(stream ^ scramble(index)));
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
pub fn scramble(value: u64) -> u64 {
    let z = value.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}
