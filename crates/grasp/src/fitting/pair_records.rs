//! Photo and aligned picture, as records of equal length in a file: the training data of the likeness.

use sdg_shape::{Pair, SIDE};

/// Pixels of a pair.
const AREA: usize = SIDE * SIDE;
/// Bytes of a record: [`PairFacts`], then photo, picture and a byte of flags for each pixel.
pub const PAIR_RECORD_BYTES: usize = 4 + 7 * AREA;
/// Bits of a pixel's flags.
const INSIDE: u8 = 1;
const PHOTO: u8 = 2;
const PICTURE: u8 = 4;
/// Bits of the second byte.
const RIGHT: u8 = 1;
const CLEAR: u8 = 2;

/// The data of a pair besides its pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PairFacts {
    /// The use of the example, as a number defined by the trainer.
    pub stream: u8,
    /// Index of the part.
    pub part_idx: u16,
    /// Whether the picture shows the part at the pose of the alignment.
    pub is_right: bool,
    /// Whether the part is uncovered, so that the picture can serve as a photo of it.
    pub is_clear: bool,
}

/// Appends a record.
pub fn append_pair(bytes: &mut Vec<u8>, facts: PairFacts, pair: &Pair) {
    let flag = |is: bool, bit| if is { bit } else { 0 };
    bytes.extend([facts.stream, flag(facts.is_right, RIGHT) | flag(facts.is_clear, CLEAR)]);
    bytes.extend(facts.part_idx.to_le_bytes());
    for colors in [&pair.photo, &pair.picture] {
        for color in colors {
            bytes.extend(color.unwrap_or_default().map(|value| (255.0 * value).round() as u8));
        }
    }
    for ((photo, picture), inside) in pair.photo.iter().zip(&pair.picture).zip(&pair.inside) {
        bytes.push(flag(*inside, INSIDE) | flag(photo.is_some(), PHOTO) | flag(picture.is_some(), PICTURE));
    }
}

/// The facts of a record.
///
/// # Panics
/// For fewer than four bytes.
pub fn pair_facts(record: &[u8]) -> PairFacts {
    PairFacts {
        stream: record[0],
        is_right: record[1] & RIGHT != 0,
        is_clear: record[1] & CLEAR != 0,
        part_idx: u16::from_le_bytes([record[2], record[3]]),
    }
}

/// The pixels of a record.
///
/// # Panics
/// For fewer than [`PAIR_RECORD_BYTES`].
pub fn pair_of(record: &[u8]) -> Pair {
    let record = &record[4..PAIR_RECORD_BYTES];
    let flags = &record[6 * AREA..];
    let colors = |from: usize, bit: u8| {
        let color = |i: usize| {
            let value = |c: usize| f32::from(record[from + 3 * i + c]) / 255.0;
            (flags[i] & bit != 0).then(|| [value(0), value(1), value(2)])
        };
        (0..AREA).map(color).collect()
    };
    Pair {
        photo: colors(0, PHOTO),
        picture: colors(3 * AREA, PICTURE),
        inside: flags.iter().map(|flag| flag & INSIDE != 0).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_record_gives_back_what_was_written() {
        let color = |i: usize| (!i.is_multiple_of(5)).then_some([(i % 256) as f32 / 255.0, 0.0, 1.0]);
        let pair = Pair {
            photo: (0..AREA).map(|i| color(i + 1)).collect(),
            picture: (0..AREA).map(color).collect(),
            inside: (0..AREA).map(|i| i.is_multiple_of(3)).collect(),
        };
        let facts = PairFacts { stream: 1, part_idx: 700, is_right: true, is_clear: false };
        let mut bytes = Vec::new();
        append_pair(&mut bytes, facts, &pair);
        assert_eq!(bytes.len(), PAIR_RECORD_BYTES);
        assert_eq!((pair_facts(&bytes), pair_of(&bytes)), (facts, pair));
    }
}
