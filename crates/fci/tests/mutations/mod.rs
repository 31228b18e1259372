//! Random errors in messages, by seed.

use rand::Rng;
use rand_pcg::Pcg64Mcg;
use sdg_fci::wire::MAX_MESSAGE_SIZE;

/// Changes bytes, truncates, doubles or lengthens, in half of the cases more than once.
pub fn mutate(bytes: &mut Vec<u8>, rng: &mut Pcg64Mcg) {
    for _ in 0..rng.random_range(1..=4) {
        let length = bytes.len();
        match rng.random_range(0..6) {
            0 if length > 0 => bytes[rng.random_range(0..length)] = rng.random(),
            1 if length > 0 => bytes[rng.random_range(0..length)] ^= 1 << rng.random_range(0..8),
            2 => bytes.truncate(rng.random_range(0..=length)),
            3 => bytes.extend((0..rng.random_range(1..40)).map(|_| rng.random::<u8>())),
            4 if length >= 4 => {
                // Numbers at the ends of their ranges.
                let at = rng.random_range(0..=length - 4);
                let extreme = [0, 1, 0x7fff_ffff, 0x8000_0000, u32::MAX, MAX_MESSAGE_SIZE, MAX_MESSAGE_SIZE + 1];
                bytes[at..at + 4].copy_from_slice(&extreme[rng.random_range(0..extreme.len())].to_le_bytes());
            }
            _ if length > 0 => {
                let (from, to) = (rng.random_range(0..length), rng.random_range(0..length));
                let piece = bytes[from.min(to)..from.max(to)].to_vec();
                bytes.extend(piece);
            }
            _ => {}
        }
    }
}
