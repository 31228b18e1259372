//! Splits a stream of bytes into single pictures: consecutive JPEG, PNG and PPM files, as programs write them.

use bytes::{Buf, BytesMut};
use sdg_picture::{JpegEnd, JpegScanner, PpmHead};

use crate::decode::{MAX_ENCODED_BYTES, PNG_START};

/// Number of bytes outside pictures at which they are reported although no picture follows.
const MAX_GARBAGE_BYTES: usize = 1 << 20;

/// The start marker, and the first byte of the next marker.
const JPEG_START: [u8; 3] = [0xff, 0xd8, 0xff];

/// Splits a stream at the ends of pictures.
#[derive(Debug, Default)]
pub(crate) struct Splitter {
    buffer: BytesMut,
    jpeg: JpegScanner,
    garbage_bytes: usize,
}

/// The extent of the picture at the beginning of the buffer.
enum Extent {
    /// Complete, with this number of bytes.
    Ends(usize),
    NotYet,
    /// Broken: the reason, and the number of bytes to discard.
    Broken(String, usize),
    /// No picture begins here.
    None,
}

impl Splitter {
    /// Appends received bytes.
    pub(crate) fn push(&mut self, bytes: &[u8]) {
        self.buffer.extend_from_slice(bytes);
    }

    /// The next complete picture, still encoded; `None` if more data is needed.
    ///
    /// # Errors
    /// Text that describes the data found instead of a complete picture. The next call continues after it.
    pub(crate) fn next_picture(&mut self) -> Option<Result<Vec<u8>, String>> {
        loop {
            match self.extent() {
                Extent::None if self.buffer.is_empty() => return None,
                Extent::None => {
                    self.skip_garbage();
                    if self.garbage_bytes >= MAX_GARBAGE_BYTES {
                        return self.take_garbage().map(Err);
                    }
                }
                // The next bytes show whether the garbage has ended.
                Extent::NotYet if self.buffer.len() < PNG_START.len() => return None,
                _ if self.garbage_bytes > 0 => return self.take_garbage().map(Err),
                Extent::NotYet => return None,
                Extent::Ends(end) => {
                    self.jpeg = JpegScanner::default();
                    return Some(Ok(self.buffer.split_to(end).to_vec()));
                }
                Extent::Broken(why, bytes) => {
                    self.jpeg = JpegScanner::default();
                    self.buffer.advance(bytes.min(self.buffer.len()));
                    return Some(Err(why));
                }
            }
        }
    }

    /// A description of the incomplete picture or the garbage at the end of the stream, if any.
    pub(crate) fn rest(&mut self) -> Option<String> {
        match self.buffer.len() {
            0 => self.take_garbage(),
            left => Some(format!("a picture that ends after {left} bytes")),
        }
    }

    fn extent(&mut self) -> Extent {
        let bytes = &self.buffer[..];
        let extent = if !may_begin_picture(bytes) {
            Extent::None
        } else if bytes[0] == JPEG_START[0] {
            match self.jpeg.advance(bytes) {
                JpegEnd::At(end) => Extent::Ends(end),
                JpegEnd::NotYet => Extent::NotYet,
                JpegEnd::Broken(at) => {
                    // A JPEG that was cut within a segment contains the beginning of the next picture.
                    let next = bytes[2..].windows(JPEG_START.len()).position(|start| start == JPEG_START);
                    let next = next.map_or(at, |next| at.min(next + 2));
                    Extent::Broken(format!("a JPEG that ends after {next} bytes"), next.max(1))
                }
            }
        } else if bytes[0] == PNG_START[0] {
            png_extent(bytes)
        } else {
            match PpmHead::read(bytes) {
                Ok(Some(head)) if bytes.len() >= head.end() => Extent::Ends(head.end()),
                Ok(_) => return Extent::NotYet,
                Err(why) => Extent::Broken(why, 2),
            }
        };
        match extent {
            Extent::NotYet if bytes.len() > MAX_ENCODED_BYTES => {
                Extent::Broken(format!("a picture of more than {MAX_ENCODED_BYTES} bytes"), bytes.len())
            }
            extent => extent,
        }
    }

    /// Discards bytes up to the next possible beginning of a picture. Blanks and zeros between pictures are common and
    /// not counted.
    fn skip_garbage(&mut self) {
        let begin = (1..self.buffer.len()).find(|&at| may_begin_picture(&self.buffer[at..]));
        let skipped = begin.unwrap_or(self.buffer.len());
        let counts = |byte: &&u8| **byte != 0 && !byte.is_ascii_whitespace();
        self.garbage_bytes += self.buffer.split_to(skipped).iter().filter(counts).count();
    }

    fn take_garbage(&mut self) -> Option<String> {
        match std::mem::take(&mut self.garbage_bytes) {
            0 => None,
            count => Some(format!("{count} bytes that are not the beginning of a JPEG, PNG or PPM")),
        }
    }
}

/// Whether the bytes can be the beginning of a picture.
fn may_begin_picture(bytes: &[u8]) -> bool {
    let begins = |start: &[u8]| bytes.iter().zip(start).all(|(found, expected)| found == expected);
    let is_ppm = || begins(b"P6") && bytes.get(2).is_none_or(|blank| blank.is_ascii_whitespace() || *blank == b'#');
    !bytes.is_empty() && (begins(&JPEG_START) || begins(&PNG_START) || is_ppm())
}

fn png_extent(bytes: &[u8]) -> Extent {
    let mut at = PNG_START.len();
    loop {
        let Some(&[a, b, c, d, ref kind @ ..]) = bytes.get(at..at + 8).and_then(|head| head.first_chunk::<8>()) else {
            return Extent::NotYet;
        };
        let length = u32::from_be_bytes([a, b, c, d]) as usize;
        if length > MAX_ENCODED_BYTES {
            return Extent::Broken(format!("a PNG with a part of {length} bytes"), PNG_START.len());
        }
        at += 12 + length;
        if kind == b"IEND" {
            return if at <= bytes.len() { Extent::Ends(at) } else { Extent::NotYet };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::{ImageFormat, RgbImage};
    use std::io::Cursor;

    fn png() -> Vec<u8> {
        let mut png = Vec::new();
        RgbImage::new(5, 4).write_to(&mut Cursor::new(&mut png), ImageFormat::Png).unwrap();
        png
    }

    /// All results if the stream arrives in pieces of `piece` bytes.
    fn split(stream: &[u8], piece: usize) -> (Vec<Result<Vec<u8>, String>>, Option<String>) {
        let mut splitter = Splitter::default();
        let mut found = Vec::new();
        for piece in stream.chunks(piece) {
            splitter.push(piece);
            found.extend(std::iter::from_fn(|| splitter.next_picture()));
        }
        (found, splitter.rest())
    }

    #[test]
    fn pictures_of_three_kinds_come_out_whole_in_any_pieces() {
        let jpeg = crate::decode::tests::jpeg(20, 10);
        // Pixels that look like the beginnings of pictures.
        let ppm = [b"P6\n3 2\n255\n".as_slice(), b"P6P6\xff\xd8\xff\xd9 P6 \x89P6 P6"].concat();
        let stream = [&jpeg, &ppm, &png(), b"\n\n\0\0".as_slice(), &jpeg, &jpeg, &png()].concat();
        for piece in [1, 2, 3, 11, 1000, stream.len()] {
            let (found, rest) = split(&stream, piece);
            let expected = [&jpeg, &ppm, &png(), &jpeg, &jpeg, &png()].map(|picture| Ok(picture.clone()));
            assert_eq!((found, rest), (expected.to_vec(), None), "pieces of {piece}");
        }
    }

    #[test]
    fn a_picture_that_does_not_end_is_given_up() {
        let jpeg = crate::decode::tests::jpeg(20, 10);
        let endless = [&jpeg[..jpeg.len() - 2], &vec![0; MAX_ENCODED_BYTES + (2 << 20)], &jpeg].concat();
        let (found, rest) = split(&endless, 1 << 20);
        let refused = format!("a picture of more than {MAX_ENCODED_BYTES} bytes");
        assert_eq!((found, rest), (vec![Err(refused), Ok(jpeg)], None));
    }

    #[test]
    fn torn_pictures_and_garbage_are_told_and_passed_over() {
        let jpeg = crate::decode::tests::jpeg(20, 10);
        let stream = [b"hello P6x ".as_slice(), &jpeg[..400], &jpeg, b"P6 0 0 255\n", &png(), &jpeg[..99]].concat();
        for piece in [1, 64, stream.len()] {
            let (found, rest) = split(&stream, piece);
            let texts: Vec<_> = found.iter().filter_map(|found| found.as_ref().err()).collect();
            assert!(texts[0].contains("8 bytes that are not the beginning of a JPEG"), "{texts:?}");
            assert!(texts[1].contains("after 400 bytes"), "{texts:?}");
            assert!(texts[2].contains("0 × 0"), "{texts:?}");
            let pictures: Vec<_> = found.iter().filter_map(|found| found.as_ref().ok()).collect();
            assert_eq!(pictures, [&jpeg, &png()]);
            assert!(rest.is_some_and(|rest| rest.contains("ends after 99 bytes")));
        }
    }

    #[test]
    fn many_small_pictures_in_a_torn_one_take_linear_time() {
        // A PNG with a part of 4 MB that contains PPM pictures, and after it a part of impossible length.
        let small = b"P6 1 1 255\nrgb";
        let content = small.repeat((4 << 20) / small.len());
        let head = [&PNG_START[..], &(content.len() as u32).to_be_bytes(), b"text"].concat();
        let stream = [&head[..], &content, &[0; 4], &[0xff; 8]].concat();
        let start = std::time::Instant::now();
        let (found, _) = split(&stream, stream.len());
        assert_eq!(found.iter().filter(|found| found.is_ok()).count(), content.len() / small.len());
        // An earlier version, which copied the rest for each picture, took 25 seconds.
        assert!(start.elapsed().as_secs() < 10, "{:?}", start.elapsed());
    }

    #[test]
    fn endless_garbage_is_reported_and_not_kept() {
        let (found, _) = split(&vec![b'x'; (MAX_GARBAGE_BYTES * 5) / 2], 1 << 16);
        assert_eq!(found.len(), 2);
        let mut splitter = Splitter::default();
        splitter.push(&vec![b'x'; 1 << 16]);
        assert!(splitter.next_picture().is_none() && splitter.buffer.is_empty());
    }
}
