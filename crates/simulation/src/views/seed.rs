//! The seed of a picture.

/// FNV-1a over the names' bytes, mixed with the numbers: each part has its own seed, so that one unfavourable lamp does
/// not affect all parts.
pub(super) fn seed_of(names: impl Iterator<Item = u8>, number: u64, seed: u64) -> u64 {
    let named =
        names.fold(0xcbf2_9ce4_8422_2325u64, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3));
    named ^ seed.wrapping_mul(0xd134_2543_de82_ef95) ^ number.wrapping_mul(0x9e37_79b9_7f4a_7c15)
}
