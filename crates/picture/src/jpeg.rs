//! Finds the end of a JPEG, and adds the Huffman tables that webcams omit.

use std::borrow::Cow;
use std::io::Cursor;

use image::{DynamicImage, ImageFormat, ImageReader, Limits};

use crate::error::PictureError;

/// State of a JPEG that is being received.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum JpegEnd {
    /// Complete, with this number of bytes, including the end marker.
    At(usize),
    /// More bytes are needed.
    NotYet,
    /// Invalid; the bytes before this position can be discarded.
    Broken(usize),
}

/// Scans the markers of a JPEG without decoding it. Scanning continues at the last position, so a growing buffer is
/// read once.
#[derive(Debug, Clone, Default)]
pub struct JpegScanner {
    position: usize,
    /// Whether the position is in the entropy-coded data after a start of scan.
    is_in_scan: bool,
    first_scan: Option<usize>,
    has_huffman_tables: bool,
    has_adobe_marker: bool,
    /// Number of components, from the frame header.
    num_components: Option<u8>,
    is_progressive: bool,
    /// For progressive pictures: by component id, one bit for each coefficient (0 to 63) that was sent completely.
    sent: Vec<(u8, u64)>,
}

const START: u8 = 0xd8;
const END: u8 = 0xd9;
const START_OF_SCAN: u8 = 0xda;
const HUFFMAN_TABLES: u8 = 0xc4;
const ADOBE: u8 = 0xee;
/// The range of the frame markers. It also contains the markers of tables (0xc4) and of arithmetic coding (0xcc), and a
/// reserved one (0xc8); these are matched before the range.
const FRAMES: std::ops::RangeInclusive<u8> = 0xc0..=0xcf;
const PROGRESSIVE: u8 = 0xc2;

impl JpegScanner {
    /// Continues scanning. `bytes` begin with the start marker and extend the bytes of the previous call.
    pub fn advance(&mut self, bytes: &[u8]) -> JpegEnd {
        if self.position == 0 {
            match bytes {
                [0xff, START, ..] => self.position = 2,
                [] | [0xff] => return JpegEnd::NotYet,
                _ => return JpegEnd::Broken(bytes.len()),
            }
        }
        loop {
            if self.is_in_scan {
                // In entropy-coded data, 0xff is always followed by 0x00 or by the second byte of a restart marker.
                let rest = &bytes[self.position..];
                match rest.windows(2).position(|pair| pair[0] == 0xff && !matches!(pair[1], 0x00 | 0xd0..=0xd7)) {
                    Some(marker) => self.position += marker,
                    None => {
                        self.position += rest.len().saturating_sub(1);
                        return JpegEnd::NotYet;
                    }
                }
                self.is_in_scan = false;
            }
            let Some(&[prefix, marker]) = bytes.get(self.position..self.position + 2).and_then(|b| b.first_chunk())
            else {
                return JpegEnd::NotYet;
            };
            if prefix != 0xff {
                return JpegEnd::Broken(self.position);
            }
            match marker {
                0xff => self.position += 1,
                END => return JpegEnd::At(self.position + 2),
                // A start marker means that the next picture begins and the rest of this one was lost.
                START => return JpegEnd::Broken(self.position),
                0x01 | 0xd0..=0xd7 => self.position += 2,
                _ => {
                    let Some(&length) = bytes.get(self.position + 2..self.position + 4).and_then(|b| b.first_chunk())
                    else {
                        return JpegEnd::NotYet;
                    };
                    let length = usize::from(u16::from_be_bytes(length));
                    let segment = bytes.get(self.position + 4..self.position + 2 + length.max(2)).unwrap_or_default();
                    match marker {
                        HUFFMAN_TABLES => self.has_huffman_tables = true,
                        ADOBE => self.has_adobe_marker |= segment.starts_with(b"Adobe"),
                        START_OF_SCAN => {
                            self.first_scan.get_or_insert(self.position);
                            self.is_in_scan = true;
                            self.note_sent(segment);
                        }
                        0xc8 | 0xcc => {}
                        _ if FRAMES.contains(&marker) => {
                            self.num_components = segment.get(5).copied();
                            self.is_progressive = marker == PROGRESSIVE;
                        }
                        _ => {}
                    }
                    if length < 2 {
                        return JpegEnd::Broken(self.position + 2);
                    }
                    if bytes.len() < self.position + 2 + length {
                        // The segment is read again when there is more data; this sets the same fields again.
                        self.is_in_scan = false;
                        return JpegEnd::NotYet;
                    }
                    self.position += 2 + length;
                }
            }
        }
    }
}

impl JpegScanner {
    /// Records the coefficients that a scan's header announces.
    fn note_sent(&mut self, header: &[u8]) {
        let Some((&count, rest)) = header.split_first() else { return };
        let Some((components, [first, last, bits, ..])) = rest.split_at_checked(2 * usize::from(count)) else { return };
        let is_last_bit = bits & 0x0f == 0;
        if !is_last_bit || *first > *last || *last > 63 {
            return;
        }
        let coefficients = (u64::MAX >> (63 - last)) & (u64::MAX << first);
        for component in components.chunks_exact(2) {
            match self.sent.iter_mut().find(|(number, _)| *number == component[0]) {
                Some((_, sent)) => *sent |= coefficients,
                None => self.sent.push((component[0], coefficients)),
            }
        }
    }

    /// Whether the scans so far contain all coefficients of a progressive picture; true for other pictures.
    fn is_fully_sent(&self) -> bool {
        !self.is_progressive
            || self.num_components.is_some_and(|count| self.sent.len() == usize::from(count))
                && self.sent.iter().all(|(_, sent)| *sent == u64::MAX)
    }
}

/// Returns the JPEG at the beginning of the bytes, without following data, and with Huffman tables and an end marker.
///
/// Motion JPEG (AVI1, USB video class) may omit the tables of the JPEG standard's annex K, sections K.3.1 and K.3.2;
/// they are then inserted before the first scan. Some cameras omit the end marker: it is added if the data before it
/// are complete, which is checked on pictures of up to `max_bytes`.
///
/// # Errors
/// Truncated or invalid data, data without a picture, or CMYK inks without Adobe's marker, for which it is unknown
/// whether they are inverted.
pub(crate) fn complete_jpeg(bytes: &[u8], max_bytes: u64) -> Result<Cow<'_, [u8]>, PictureError> {
    let damaged = |reason: String| PictureError::DamagedImage { format: "JPEG", reason };
    let mut scanner = JpegScanner::default();
    let (jpeg, lacks_end) = match scanner.advance(bytes) {
        JpegEnd::At(end) => (&bytes[..end], false),
        JpegEnd::NotYet => (bytes, true),
        JpegEnd::Broken(at) => return Err(damaged(format!("it breaks off after {at} of {} bytes", bytes.len()))),
    };
    let truncated = || damaged(format!("truncated, it ends after {} bytes without its end marker", bytes.len()));
    let Some(scan) = scanner.first_scan else {
        if lacks_end {
            return Err(truncated());
        }
        return Err(damaged(format!("{} bytes without a picture in them", jpeg.len())));
    };
    if scanner.num_components == Some(4) && !scanner.has_adobe_marker {
        return Err(PictureError::UnsupportedKind {
            format: "JPEG",
            found: "CMYK inks without Adobe's marker, so it is unknown whether they are inverted".to_owned(),
            remedy: "export it as RGB",
        });
    }
    let mut jpeg = Cow::Borrowed(jpeg);
    if !scanner.has_huffman_tables {
        jpeg = Cow::Owned([&jpeg[..scan], &STANDARD_HUFFMAN_TABLES, &jpeg[scan..]].concat());
    }
    if lacks_end {
        let ended = [without_fill_bytes(&jpeg), &[0xff, END]].concat();
        if !scanner.is_fully_sent() || !is_complete(&ended, max_bytes) {
            return Err(truncated());
        }
        jpeg = Cow::Owned(ended);
    }
    Ok(jpeg)
}

/// Removes 0xff bytes at the end: fill bytes, which may precede a marker.
fn without_fill_bytes(jpeg: &[u8]) -> &[u8] {
    let end = jpeg.iter().rposition(|byte| *byte != 0xff).map_or(0, |last| last + 1);
    &jpeg[..end]
}

/// Whether the data before the end marker contain every block. The decoder fills missing blocks depending on the bytes
/// that follow, so only complete data give the same picture whatever follows them.
fn is_complete(jpeg: &[u8], max_bytes: u64) -> bool {
    let with = |filler: &[u8]| {
        let (data, end) = jpeg.split_at(jpeg.len() - 2);
        decoded(&[data, filler, end].concat(), max_bytes)
    };
    let found = with(&[]);
    found.is_some() && found == with(&[0x55; 64]) && found == with(&[0xaa; 64])
}

/// The picture of a complete JPEG; `None` if it cannot be decoded, or only to more than `max_bytes`. The decoder's
/// default limit is below that of [`ImageLimits`](crate::ImageLimits).
pub(crate) fn decoded(jpeg: &[u8], max_bytes: u64) -> Option<DynamicImage> {
    let mut limits = Limits::default();
    limits.max_alloc = Some(max_bytes);
    let mut reader = ImageReader::with_format(Cursor::new(jpeg), ImageFormat::Jpeg);
    reader.limits(limits);
    reader.decode().ok()
}

/// A segment with the four tables of annex K: luminance and chrominance DC, luminance and chrominance AC.
#[rustfmt::skip]
const STANDARD_HUFFMAN_TABLES: [u8; 420] = [
    0xff, 0xc4, 0x01, 0xa2, 0x00, 0x00, 0x01, 0x05, 0x01, 0x01, 0x01, 0x01, 0x01, 0x01, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00,
    0x00, 0x00, 0x01, 0x02, 0x03, 0x04, 0x05, 0x06, 0x07, 0x08, 0x09, 0x0a, 0x0b, 0x01, 0x00, 0x03, 0x01, 0x01, 0x01, 0x01,
    0x01, 0x01, 0x01, 0x01, 0x01, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x01, 0x02, 0x03, 0x04, 0x05, 0x06, 0x07, 0x08, 0x09,
    0x0a, 0x0b, 0x10, 0x00, 0x02, 0x01, 0x03, 0x03, 0x02, 0x04, 0x03, 0x05, 0x05, 0x04, 0x04, 0x00, 0x00, 0x01, 0x7d, 0x01,
    0x02, 0x03, 0x00, 0x04, 0x11, 0x05, 0x12, 0x21, 0x31, 0x41, 0x06, 0x13, 0x51, 0x61, 0x07, 0x22, 0x71, 0x14, 0x32, 0x81,
    0x91, 0xa1, 0x08, 0x23, 0x42, 0xb1, 0xc1, 0x15, 0x52, 0xd1, 0xf0, 0x24, 0x33, 0x62, 0x72, 0x82, 0x09, 0x0a, 0x16, 0x17,
    0x18, 0x19, 0x1a, 0x25, 0x26, 0x27, 0x28, 0x29, 0x2a, 0x34, 0x35, 0x36, 0x37, 0x38, 0x39, 0x3a, 0x43, 0x44, 0x45, 0x46,
    0x47, 0x48, 0x49, 0x4a, 0x53, 0x54, 0x55, 0x56, 0x57, 0x58, 0x59, 0x5a, 0x63, 0x64, 0x65, 0x66, 0x67, 0x68, 0x69, 0x6a,
    0x73, 0x74, 0x75, 0x76, 0x77, 0x78, 0x79, 0x7a, 0x83, 0x84, 0x85, 0x86, 0x87, 0x88, 0x89, 0x8a, 0x92, 0x93, 0x94, 0x95,
    0x96, 0x97, 0x98, 0x99, 0x9a, 0xa2, 0xa3, 0xa4, 0xa5, 0xa6, 0xa7, 0xa8, 0xa9, 0xaa, 0xb2, 0xb3, 0xb4, 0xb5, 0xb6, 0xb7,
    0xb8, 0xb9, 0xba, 0xc2, 0xc3, 0xc4, 0xc5, 0xc6, 0xc7, 0xc8, 0xc9, 0xca, 0xd2, 0xd3, 0xd4, 0xd5, 0xd6, 0xd7, 0xd8, 0xd9,
    0xda, 0xe1, 0xe2, 0xe3, 0xe4, 0xe5, 0xe6, 0xe7, 0xe8, 0xe9, 0xea, 0xf1, 0xf2, 0xf3, 0xf4, 0xf5, 0xf6, 0xf7, 0xf8, 0xf9,
    0xfa, 0x11, 0x00, 0x02, 0x01, 0x02, 0x04, 0x04, 0x03, 0x04, 0x07, 0x05, 0x04, 0x04, 0x00, 0x01, 0x02, 0x77, 0x00, 0x01,
    0x02, 0x03, 0x11, 0x04, 0x05, 0x21, 0x31, 0x06, 0x12, 0x41, 0x51, 0x07, 0x61, 0x71, 0x13, 0x22, 0x32, 0x81, 0x08, 0x14,
    0x42, 0x91, 0xa1, 0xb1, 0xc1, 0x09, 0x23, 0x33, 0x52, 0xf0, 0x15, 0x62, 0x72, 0xd1, 0x0a, 0x16, 0x24, 0x34, 0xe1, 0x25,
    0xf1, 0x17, 0x18, 0x19, 0x1a, 0x26, 0x27, 0x28, 0x29, 0x2a, 0x35, 0x36, 0x37, 0x38, 0x39, 0x3a, 0x43, 0x44, 0x45, 0x46,
    0x47, 0x48, 0x49, 0x4a, 0x53, 0x54, 0x55, 0x56, 0x57, 0x58, 0x59, 0x5a, 0x63, 0x64, 0x65, 0x66, 0x67, 0x68, 0x69, 0x6a,
    0x73, 0x74, 0x75, 0x76, 0x77, 0x78, 0x79, 0x7a, 0x82, 0x83, 0x84, 0x85, 0x86, 0x87, 0x88, 0x89, 0x8a, 0x92, 0x93, 0x94,
    0x95, 0x96, 0x97, 0x98, 0x99, 0x9a, 0xa2, 0xa3, 0xa4, 0xa5, 0xa6, 0xa7, 0xa8, 0xa9, 0xaa, 0xb2, 0xb3, 0xb4, 0xb5, 0xb6,
    0xb7, 0xb8, 0xb9, 0xba, 0xc2, 0xc3, 0xc4, 0xc5, 0xc6, 0xc7, 0xc8, 0xc9, 0xca, 0xd2, 0xd3, 0xd4, 0xd5, 0xd6, 0xd7, 0xd8,
    0xd9, 0xda, 0xe2, 0xe3, 0xe4, 0xe5, 0xe6, 0xe7, 0xe8, 0xe9, 0xea, 0xf2, 0xf3, 0xf4, 0xf5, 0xf6, 0xf7, 0xf8, 0xf9, 0xfa,
];

#[cfg(test)]
mod tests {
    use super::*;
    use image::codecs::jpeg::JpegEncoder;
    use image::{Rgb, RgbImage};

    /// A picture of many colours and edges as JPEG.
    fn jpeg(width: u32, height: u32) -> Vec<u8> {
        let picture = RgbImage::from_fn(width, height, |x, y| Rgb([(x * 7) as u8, (y * 5) as u8, (x * y) as u8]));
        let mut bytes = Vec::new();
        JpegEncoder::new_with_quality(&mut bytes, 90).encode_image(&picture).unwrap();
        bytes
    }

    /// The bytes of each segment before the first scan, and the bytes after these segments.
    fn segments(jpeg: &[u8]) -> (Vec<&[u8]>, &[u8]) {
        let (mut found, mut at) = (Vec::new(), 2);
        while jpeg[at + 1] != START_OF_SCAN {
            let end = at + 2 + usize::from(u16::from_be_bytes([jpeg[at + 2], jpeg[at + 3]]));
            found.push(&jpeg[at..end]);
            at = end;
        }
        (found, &jpeg[at..])
    }

    /// A JPEG without tables, as webcams send it.
    fn without_tables(jpeg: &[u8]) -> Vec<u8> {
        let (segments, rest) = segments(jpeg);
        let kept: Vec<u8> = segments.into_iter().filter(|s| s[1] != HUFFMAN_TABLES).flatten().copied().collect();
        [&jpeg[..2], &kept, rest].concat()
    }

    fn complete(jpeg: &[u8]) -> Result<Cow<'_, [u8]>, PictureError> {
        complete_jpeg(jpeg, u64::MAX)
    }

    #[test]
    fn tables_that_were_left_out_are_put_in() {
        let original = jpeg(40, 30);
        assert!(matches!(complete(&original), Ok(Cow::Borrowed(same)) if same == original));
        let bare = without_tables(&original);
        assert_eq!(
            bare.len(),
            original.len() - 432,
            "four segments of the encoder: 420 bytes of tables, 12 of markers"
        );
        let decode = |bytes: &[u8]| image::load_from_memory(bytes).map(|picture| picture.to_rgb8());
        assert!(decode(&bare).is_err(), "the decoder needs the tables");
        assert_eq!(decode(&complete(&bare).unwrap()).unwrap(), decode(&original).unwrap());
    }

    #[test]
    fn what_follows_the_end_is_cut_off_and_what_has_no_end_is_refused() {
        let original = jpeg(40, 30);
        let padded = [original.as_slice(), &[0; 9]].concat();
        assert_eq!(complete(&padded).unwrap(), original);
        for length in [2, 3, 20, 300, original.len() / 2, original.len() - 60] {
            let error = complete(&original[..length]).unwrap_err().to_string();
            assert!(error.contains(&format!("{length} bytes")), "{error}");
        }
        assert!(complete(&[0xff, START, 0xff, END]).unwrap_err().to_string().contains("without a picture"));
        assert!(complete(b"GIF89a").unwrap_err().to_string().contains("breaks off"));
        // The first half, then the next picture.
        let torn = [&original[..700], &original].concat();
        assert!(complete(&torn).unwrap_err().to_string().contains("breaks off after 700 of"));
    }

    #[test]
    fn complete_data_without_an_end_marker_are_read() {
        let original = jpeg(64, 48);
        for cut in [1, 2] {
            assert_eq!(complete(&original[..original.len() - cut]).unwrap(), original, "{cut}");
        }
        let decode = |bytes: &[u8]| image::load_from_memory(bytes).unwrap().to_rgb8();
        let whole = decode(&original);
        // Missing bytes must be either irrelevant or reported.
        for cut in 3..200 {
            if let Ok(read) = complete(&original[..original.len() - cut]) {
                assert!(decode(&read) == whole, "{cut} bytes");
            }
        }
        assert!((5..100).all(|cut| complete(&original[..original.len() - cut]).is_err()));
    }

    #[test]
    fn the_check_of_complete_data_has_the_given_limit() {
        let original = jpeg(64, 48);
        let cut = &original[..original.len() - 2];
        assert_eq!(complete_jpeg(cut, 3 * 64 * 48).unwrap(), original);
        assert!(complete_jpeg(cut, 3 * 64 * 48 - 1).is_err());
    }

    #[test]
    fn inks_are_read_with_adobes_marker_alone() {
        let mut inks = jpeg(16, 16);
        let frame = inks.windows(2).position(|pair| pair == [0xff, 0xc0]).unwrap();
        inks[frame + 9] = 4;
        assert!(complete(&inks).unwrap_err().to_string().contains("CMYK"));
        inks.splice(2..2, *b"\xff\xee\x00\x0eAdobe\0\x64\0\0\0\0\0");
        assert!(complete(&inks).is_ok());
    }

    #[test]
    fn a_growing_jpeg_is_walked_over_in_any_pieces() {
        let original = jpeg(64, 48);
        for piece in [1, 2, 3, 7, 100] {
            let mut scanner = JpegScanner::default();
            for end in (0..original.len()).step_by(piece) {
                assert_eq!(scanner.advance(&original[..end]), JpegEnd::NotYet, "{end} of {}", original.len());
            }
            assert_eq!(scanner.advance(&original), JpegEnd::At(original.len()));
        }
    }
}
