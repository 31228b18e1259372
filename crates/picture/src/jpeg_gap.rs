//! Detects a run of zeros in JPEG data, as left by an interrupted copy or a damaged card.
//!
//! Zeros are valid codes, so the decoder continues and gives a wrong picture without an error. They decode to a
//! different number of blocks than the original data, so at the next marker data are missing or left over.

use image::{DynamicImage, GenericImageView};

use crate::error::PictureError;
use crate::jpeg::decoded;

/// Minimum number of zeros in a row. Shorter runs occur in many intact pictures. Longer runs occur in intact pictures
/// with large areas of one colour; the check distinguishes these from gaps.
const MIN_ZEROS: usize = 32;
/// Number of bytes appended to the data to find out whether the decoder reads them.
const ADDED_BYTES: usize = 64;
/// Number of bytes replaced at the end of the data, for the same purpose.
const EXCHANGED_BYTES: usize = 8;
/// Maximum number of stretches whose end is tested, and of pixels decoded for these tests. The picture is decoded up to
/// four times for each stretch; one stretch is tested in any case. The order of restart markers is tested at each
/// stretch with a run of zeros.
const MAX_TESTED: u64 = 8;
const MAX_TESTED_PIXELS: u64 = 400_000_000;
/// Two fill values, because the original bytes may happen to give the same result as one of them.
const PROBES: [u8; 2] = [0x55, 0xaa];

/// Entropy-coded data up to the next marker.
struct Stretch {
    start: usize,
    end: usize,
    /// Number of the restart marker after the data, from 0 to 7.
    restart: Option<u8>,
}

/// Checks that zeros in the data are codes of the picture, if it decodes to at most `max_bytes`.
///
/// # Errors
/// After a run of zeros, the data and the blocks do not end together, or restart markers are out of sequence.
pub(crate) fn check_has_no_gap(jpeg: &[u8], max_bytes: u64) -> Result<(), PictureError> {
    let stretches = stretches(jpeg);
    let zeros_in = |stretch: &Stretch| {
        let data = &jpeg[stretch.start..stretch.end];
        data.windows(MIN_ZEROS).position(|run| run.iter().all(|byte| *byte == 0)).map(|at| stretch.start + at)
    };
    let mut ends: Option<Ends<'_>> = None;
    for (idx, stretch) in stretches.iter().enumerate() {
        let Some(at) = zeros_in(stretch) else { continue };
        let before = idx.checked_sub(1).and_then(|before| stretches[before].restart);
        let is_in_order = match (before, stretch.restart) {
            (Some(before), Some(after)) => after == (before + 1) % 8,
            (None, Some(after)) => after == 0,
            (_, None) => true,
        };
        if !is_in_order || !ends.get_or_insert_with(|| Ends::of(jpeg, max_bytes)).ends_with_its_blocks(stretch) {
            let count = jpeg[at..].iter().take_while(|byte| **byte == 0).count();
            let reason = format!(
                "{count} zeros in a row from byte {at} in place of picture data: copy the file again from its source"
            );
            return Err(PictureError::DamagedImage { format: "JPEG", reason });
        }
    }
    Ok(())
}

/// Tests the ends of stretches.
struct Ends<'a> {
    jpeg: &'a [u8],
    max_bytes: u64,
    /// `None` if the picture cannot be decoded, or has one colour. A picture of one colour may consist only of zero
    /// codes, and the decoder fills missing blocks with the same colour.
    whole: Option<DynamicImage>,
    /// Number of stretches that may still be tested.
    left: u64,
}

impl<'a> Ends<'a> {
    fn of(jpeg: &'a [u8], max_bytes: u64) -> Self {
        let whole = decoded(jpeg, max_bytes).filter(|whole| {
            let first = whole.get_pixel(0, 0);
            whole.pixels().any(|(.., pixel)| pixel != first)
        });
        let pixels = whole.as_ref().map_or(1, |whole| u64::from(whole.width()) * u64::from(whole.height()));
        Self { jpeg, max_bytes, whole, left: (MAX_TESTED_PIXELS / (4 * pixels)).clamp(1, MAX_TESTED) }
    }

    /// Whether the decoder reads the data of a stretch to their end, and needs no data beyond.
    fn ends_with_its_blocks(&mut self, stretch: &Stretch) -> bool {
        let Some(whole) = self.whole.as_ref().filter(|_| self.left > 0) else { return true };
        self.left -= 1;
        let is_same = |kept_to: usize, filler: &[u8]| {
            let changed = [&self.jpeg[..kept_to], filler, &self.jpeg[stretch.end..]].concat();
            decoded(&changed, self.max_bytes).is_some_and(|other| other == *whole)
        };
        let runs_out = PROBES.into_iter().any(|probe| !is_same(stretch.end, &[probe; ADDED_BYTES]));
        let last = stretch.end.saturating_sub(EXCHANGED_BYTES).max(stretch.start);
        let is_left_over = PROBES.into_iter().all(|probe| is_same(last, &[probe; EXCHANGED_BYTES]));
        !runs_out && !is_left_over
    }
}

/// All entropy-coded data; invalid data end the list.
fn stretches(jpeg: &[u8]) -> Vec<Stretch> {
    const START_OF_SCAN: u8 = 0xda;
    let mut found = Vec::new();
    let mut at = 2;
    while let Some(&[0xff, marker]) = jpeg.get(at..at + 2).and_then(|pair| pair.first_chunk()) {
        let is_restart = (0xd0..=0xd7).contains(&marker);
        if marker == 0xff {
            at += 1;
            continue;
        }
        let length = match jpeg.get(at + 2..at + 4) {
            _ if is_restart => 0,
            Some(length) => usize::from(u16::from_be_bytes([length[0], length[1]])),
            None => break,
        };
        at += 2 + length;
        if marker != START_OF_SCAN && !is_restart {
            continue;
        }
        let Some(rest) = jpeg.get(at..) else { break };
        let Some(length) = rest.windows(2).position(|pair| pair[0] == 0xff && pair[1] != 0) else { break };
        let end = at + length;
        let restart = Some(jpeg[end + 1]).filter(|marker| (0xd0..=0xd7).contains(marker)).map(|marker| marker - 0xd0);
        found.push(Stretch { start: at, end, restart });
        at = end;
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::codecs::jpeg::JpegEncoder;
    use image::{Rgb, RgbImage};

    fn jpeg(picture: &RgbImage) -> Vec<u8> {
        let mut bytes = Vec::new();
        JpegEncoder::new_with_quality(&mut bytes, 90).encode_image(picture).unwrap();
        bytes
    }

    #[test]
    fn zeros_instead_of_a_part_are_told() {
        let original = jpeg(&RgbImage::from_fn(160, 120, |x, y| Rgb([(x * 7) as u8, (y * 5) as u8, (x * y) as u8])));
        let size = 3 * 160 * 120;
        check_has_no_gap(&original, size).unwrap();
        let [data] = &stretches(&original)[..] else { panic!("one scan") };
        for part in [8, 20, 40] {
            let (start, length) = ((data.start + data.end) / 2, (data.end - data.start) / part);
            let mut damaged = original.clone();
            damaged[start..start + length].fill(0);
            assert!(image::load_from_memory(&damaged).is_ok(), "expected the decoder to accept it");
            assert!(check_has_no_gap(&damaged, size - 1).is_ok(), "expected no check without memory for it");
            let told = check_has_no_gap(&damaged, size).unwrap_err().to_string();
            assert!(told.contains("zeros in a row from byte"), "{told}");
        }
    }

    #[test]
    fn a_limited_number_of_stretches_is_tested() {
        let mut damaged = jpeg(&RgbImage::from_fn(160, 120, |x, y| Rgb([(x * 7) as u8, (y * 5) as u8, (x * y) as u8])));
        let [data] = &stretches(&damaged)[..] else { panic!("one scan") };
        let middle = (data.start + data.end) / 2;
        damaged[middle..middle + 200].fill(0);
        let mut ends = Ends::of(&damaged, 3 * 160 * 120);
        let accepted: Vec<bool> = (0..10).map(|_| ends.ends_with_its_blocks(data)).collect();
        assert_eq!(accepted, [[false; 8].as_slice(), &[true; 2]].concat());
    }

    #[test]
    fn zeros_that_are_codes_are_read() {
        // Most of the 320 blocks have two bits: one for a difference of 0, one for the end of block. The second and the
        // last block have a difference of 1 and therefore four bits. All blocks together are 80.5 bytes.
        let table = |class: u8| [&[0xff, 0xc4, 0, 21, class, 1, 1][..], &[0; 14], &[0, 1]].concat();
        let quantization = [&[0xff, 0xdb, 0, 67, 0][..], &[8; 64]].concat();
        let frame = [0xff, 0xc0, 0, 11, 8, 0, 64, 1, 64, 1, 1, 0x11, 0];
        let scan = [0xff, 0xda, 0, 8, 1, 1, 0, 0, 63, 0];
        let of_data = |data: &[u8]| {
            let parts = [&[0xff, 0xd8][..], &quantization, &frame, &table(0), &table(0x10), &scan];
            [&parts.concat(), data, &[0xff, 0xd9]].concat()
        };
        let with_zeros = |count: usize| of_data(&[&[0b0010_1000][..], &vec![0; count], &[0b1010_0000]].concat());
        let check = |jpeg: &[u8]| check_has_no_gap(jpeg, u64::MAX);
        check(&with_zeros(79)).unwrap();
        assert!(check(&with_zeros(99)).is_err(), "20 bytes are left over");
        assert!(check(&with_zeros(59)).is_err(), "20 bytes are missing");
        // Only zero codes: a picture of one colour.
        check(&of_data(&[0; 80])).unwrap();
    }
}
