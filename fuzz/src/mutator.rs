//! Makes random mistakes in bytes, determined by a number.

use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

use crate::target::Target;

/// Maximum number of mistakes in one input.
const MAX_MISTAKES: u32 = 6;
/// Integers at the limits of their ranges, truncated to the written size.
const EXTREMES: [u64; 10] =
    [0, 1, 0x7f, 0xff, 0x7fff, 0xffff, 0x7fff_ffff, 0xffff_ffff, 0x7fff_ffff_ffff_ffff, 0xffff_ffff_ffff_ffff];
/// Texts that replace a number.
const NUMBERS: [&[u8]; 12] = [
    b"0",
    b"-1",
    b"1e999",
    b"-1e-999",
    b"NaN",
    b"null",
    b"\"1\"",
    b"4294967296",
    b"18446744073709551616",
    b"0.0000000001",
    b"-0.0",
    b"[[[]]]",
];

/// The input of an execution: a seed with mistakes, always the same for the same number.
pub fn mutated(target: &Target, seeds: &[Vec<u8>], number: u64) -> Vec<u8> {
    let name_hash = target
        .name
        .bytes()
        .fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3));
    let rng = &mut Pcg64Mcg::seed_from_u64(name_hash.wrapping_add(number));
    let mut bytes = seeds[rng.random_range(0..seeds.len())].clone();
    let other = &seeds[rng.random_range(0..seeds.len())];
    make_mistakes(&mut bytes, other, target.dictionary, rng);
    bytes
}

/// Makes one to six mistakes in bytes; half of the calls make exactly one. Some mistakes insert a piece of `other` or a
/// word of the format from `dictionary`.
pub fn make_mistakes(bytes: &mut Vec<u8>, other: &[u8], dictionary: &[&[u8]], rng: &mut Pcg64Mcg) {
    // Half of all inputs have one mistake, a quarter two, and so on.
    let num_mistakes = (rng.random::<u32>().trailing_zeros() + 1).min(MAX_MISTAKES);
    for _ in 0..num_mistakes {
        make_mistake(bytes, other, dictionary, rng);
    }
}

fn make_mistake(bytes: &mut Vec<u8>, other: &[u8], dictionary: &[&[u8]], rng: &mut Pcg64Mcg) {
    if bytes.is_empty() {
        bytes.extend_from_slice(other);
    }
    let length = bytes.len();
    if length == 0 {
        return bytes.push(rng.random());
    }
    let at = rng.random_range(0..length);
    let end = (at + rng.random_range(1..=32_usize)).min(length);
    match rng.random_range(0..11) {
        0 => bytes[at] ^= 1 << rng.random_range(0..8),
        1 => bytes[at] = rng.random(),
        2 => bytes.truncate(at),
        3 => drop(bytes.drain(at..end)),
        4 => {
            let piece = bytes[at..end].to_vec();
            bytes.splice(at..at, piece);
        }
        5 => bytes.splice(at..at, (0..end - at).map(|_| rng.random())).for_each(drop),
        6 => {
            let size = [1, 2, 4, 8][rng.random_range(0..4)].min(length - at);
            let extreme = EXTREMES[rng.random_range(0..EXTREMES.len())];
            let whole =
                if rng.random() { extreme.to_le_bytes() } else { extreme.rotate_right(8 * size as u32).to_be_bytes() };
            bytes[at..at + size].copy_from_slice(&whole[..size]);
        }
        7 => {
            // Replaces the first number of a text after `at`.
            let is_digit = |byte: &u8| byte.is_ascii_digit() || *byte == b'.';
            if let Some(from) = bytes[at..].iter().position(is_digit).map(|offset| at + offset) {
                let to = bytes[from..].iter().position(|byte| !is_digit(byte)).map_or(length, |offset| from + offset);
                bytes.splice(from..to, NUMBERS[rng.random_range(0..NUMBERS.len())].iter().copied());
            }
        }
        8 if !dictionary.is_empty() => {
            let word = dictionary[rng.random_range(0..dictionary.len())];
            let to = if rng.random() { at } else { (at + word.len()).min(length) };
            bytes.splice(at..to, word.iter().copied());
        }
        9 if !other.is_empty() => {
            let from = rng.random_range(0..other.len());
            let to = (from + rng.random_range(1..=512_usize)).min(other.len());
            bytes.splice(at..end, other[from..to].iter().copied());
        }
        // Exchanges two adjacent pieces.
        _ => bytes[at..].rotate_left((end - at).min(length - at - 1)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::targets::TARGETS;

    #[test]
    fn the_same_number_makes_the_same_input_and_another_another() {
        let target = &TARGETS[0];
        let seeds = (target.seeds)();
        let inputs: Vec<_> = (0..200).map(|number| mutated(target, &seeds, number)).collect();
        assert_eq!(inputs, (0..200).map(|number| mutated(target, &seeds, number)).collect::<Vec<_>>());
        let different: std::collections::HashSet<_> = inputs.iter().collect();
        assert!(different.len() > 190, "{}", different.len());
    }
}
