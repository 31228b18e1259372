//! Sizes in a WebP file that its decoder takes memory for, or relies on, before it compares them with others.
//!
//! A lossy frame is decoded before its size is compared with the picture's. In a moving picture with alpha it is not
//! compared at all, and a larger frame makes the decoder panic. The Exif block takes as much memory as its chunk claims.

use crate::error::PictureError;

/// Length of a chunk's name and size.
const CHUNK_HEADER: usize = 8;
/// Length of the fields of a moving picture's frame, which precede the frame's chunks.
const FRAME_FIELDS: usize = 16;
/// Bytes of a lossy frame after its first three.
const LOSSY: [u8; 3] = [0x9d, 0x01, 0x2a];

struct Chunk<'a> {
    name: &'a [u8],
    /// The content, or its part in the file.
    content: &'a [u8],
    is_cut: bool,
}

/// Checks the chunks of a WebP file with several chunks.
///
/// # Errors
/// A lossy frame of another size than announced, or an Exif block that ends beyond the file.
pub(crate) fn check_chunks(bytes: &[u8]) -> Result<(), PictureError> {
    let mut chunks = chunks(bytes.get(12..).unwrap_or_default());
    let Some(first) = chunks.next().filter(|chunk| chunk.name == b"VP8X") else { return Ok(()) };
    let Some(canvas) = size_at(first.content, 4) else { return Ok(()) };
    for chunk in chunks {
        match chunk.name {
            b"VP8 " | b"EXIF" => check(&chunk, Some(canvas), canvas)?,
            b"ANMF" => {
                let announced = size_at(chunk.content, 6);
                for part in self::chunks(chunk.content.get(FRAME_FIELDS..).unwrap_or_default()) {
                    check(&part, announced, canvas)?;
                }
            }
            _ => {}
        }
    }
    Ok(())
}

/// Checks a chunk in which a frame of the announced size may be. The decoder does not look at the name of a chunk behind
/// a frame's alpha.
fn check(chunk: &Chunk<'_>, announced: Option<[u32; 2]>, canvas: [u32; 2]) -> Result<(), PictureError> {
    let damaged = |reason: String| Err(PictureError::DamagedImage { format: "WebP", reason });
    if chunk.name == b"EXIF" && chunk.is_cut {
        return damaged("an Exif block that ends beyond the file".to_owned());
    }
    let Some(found) = lossy_size(chunk.content) else { return Ok(()) };
    let is_inside = found[0] <= canvas[0] && found[1] <= canvas[1];
    if is_inside && Some(found) == announced {
        return Ok(());
    }
    let [width, height] = announced.unwrap_or(canvas);
    damaged(format!("a frame of {} × {} pixels in place of {width} × {height}", found[0], found[1]))
}

/// The chunks one after the other.
fn chunks(mut rest: &[u8]) -> impl Iterator<Item = Chunk<'_>> {
    std::iter::from_fn(move || {
        let (header, behind) = rest.split_at_checked(CHUNK_HEADER)?;
        let (name, size) = header.split_at(4);
        let size = size.iter().rev().fold(0, |size, byte| size << 8 | usize::from(*byte));
        // A byte is added to a content of odd length.
        rest = behind.get(size.saturating_add(size % 2)..).unwrap_or_default();
        Some(Chunk { name, content: &behind[..size.min(behind.len())], is_cut: size > behind.len() })
    })
}

/// Width and height in three bytes each, which are stored less one.
fn size_at(bytes: &[u8], at: usize) -> Option<[u32; 2]> {
    let [a, b, c, d, e, f] = *bytes.get(at..)?.first_chunk()?;
    Some([[a, b, c, 0], [d, e, f, 0]].map(|side| u32::from_le_bytes(side) + 1))
}

/// Width and height of a lossy frame; `None` for other bytes.
fn lossy_size(frame: &[u8]) -> Option<[u32; 2]> {
    let [a, b, c, d] = *frame.get(3..)?.strip_prefix(&LOSSY)?.first_chunk()?;
    // The upper two bits are a scale, which decoders ignore.
    Some([[a, b], [c, d]].map(|side| u32::from(u16::from_le_bytes(side) & 0x3fff)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chunk(name: &[u8; 4], content: &[u8]) -> Vec<u8> {
        [name.as_slice(), &(content.len() as u32).to_le_bytes(), content].concat()
    }

    fn lossy_frame(width: u16, height: u16) -> Vec<u8> {
        [[0x10, 0, 0].as_slice(), &LOSSY, &width.to_le_bytes(), &height.to_le_bytes(), &[0; 6]].concat()
    }

    /// A picture of 8 × 6 pixels with these chunks.
    fn file(chunks: &[Vec<u8>]) -> Vec<u8> {
        let canvas = chunk(b"VP8X", &[0x10, 0, 0, 0, 7, 0, 0, 5, 0, 0]);
        [b"RIFF\0\0\0\0WEBP".as_slice(), &canvas, &chunks.concat()].concat()
    }

    fn moving(width: u16, height: u16) -> Vec<u8> {
        // At (0, 0), of 4 × 3 pixels, for 50 ms.
        let fields: [u8; 16] = [0, 0, 0, 0, 0, 0, 3, 0, 0, 2, 0, 0, 50, 0, 0, 0];
        let chunks = [chunk(b"ALPH", &[0; 13]), vec![0], chunk(b"none", &lossy_frame(width, height))].concat();
        chunk(b"ANMF", &[fields.as_slice(), &chunks].concat())
    }

    #[test]
    fn frames_have_the_announced_size() {
        for good in [chunk(b"VP8 ", &lossy_frame(8, 6)), moving(4, 3), chunk(b"EXIF", &[0; 4])] {
            assert!(check_chunks(&file(&[good])).is_ok());
        }
        for (wrong, expected) in [
            (chunk(b"VP8 ", &lossy_frame(16383, 6)), "a frame of 16383 × 6 pixels in place of 8 × 6"),
            (moving(4, 16383), "a frame of 4 × 16383 pixels in place of 4 × 3"),
            (b"EXIF\xff\xff\xff\xff".to_vec(), "an Exif block that ends beyond the file"),
            (chunk(b"ANMF", &[[0; 16].as_slice(), b"EXIF\xff\xff\xff\xff"].concat()), "an Exif block"),
        ] {
            let error = check_chunks(&file(&[chunk(b"XMP ", &[0; 2]), wrong])).unwrap_err().to_string();
            assert!(error.contains(expected), "{error}");
        }
        // A file of one chunk, and files that end early, are left to the decoder.
        let simple = [b"RIFF\0\0\0\0WEBP".to_vec(), chunk(b"VP8 ", &lossy_frame(16383, 16383))].concat();
        assert!(check_chunks(&simple).is_ok());
        let whole = file(&[moving(4, 3)]);
        assert!((0..whole.len()).all(|length| check_chunks(&whole[..length]).is_ok()));
    }
}
