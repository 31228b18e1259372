//! Binary PPM, as written by programs to pipes.

use image::RgbImage;

use crate::error::PictureError;

/// Maximum number of pixels: 67 megapixels, 192 MiB.
const MAX_PIXELS: u64 = 1 << 26;
/// Maximum width and height.
const MAX_SIDE: u32 = 1 << 14;

/// The header of a binary PPM.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PpmHead {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Index of the first byte of the pixels.
    pub start: usize,
}

impl PpmHead {
    /// Maximum length of a header, which may contain comments.
    const MAX_BYTES: usize = 1024;

    /// Reads a header; `None` while it is incomplete.
    ///
    /// # Errors
    /// A text that describes the error.
    pub fn read(bytes: &[u8]) -> Result<Option<Self>, String> {
        let mut numbers = [0_u32; 3];
        let mut at = 2;
        for number in &mut numbers {
            // Blanks and comments before the number.
            let mut is_comment = false;
            loop {
                match bytes.get(at) {
                    None if at > Self::MAX_BYTES => return Err("a PPM without the end of its header".to_owned()),
                    None => return Ok(None),
                    Some(b'\n') => is_comment = false,
                    Some(_) if is_comment => {}
                    Some(b'#') => is_comment = true,
                    Some(blank) if blank.is_ascii_whitespace() => {}
                    Some(_) => break,
                }
                at += 1;
            }
            let digits = bytes[at..].iter().take_while(|byte| byte.is_ascii_digit()).count();
            at += digits;
            match bytes.get(at) {
                None if digits < 10 => return Ok(None),
                Some(blank) if digits > 0 && blank.is_ascii_whitespace() => {}
                _ => return Err("a PPM header with text in place of a number".to_owned()),
            }
            let text = std::str::from_utf8(&bytes[at - digits..at]).unwrap_or_default();
            *number = text.parse().map_err(|_| format!("a PPM with the number {text} in its header"))?;
        }
        let [width, height, maximum] = numbers;
        if maximum != 255 {
            return Err(format!("a PPM with the maximum value {maximum}; only 255 is supported"));
        }
        let is_bounded = width <= MAX_SIDE && height <= MAX_SIDE && u64::from(width) * u64::from(height) <= MAX_PIXELS;
        if width == 0 || height == 0 || !is_bounded {
            return Err(format!("a PPM of {width} × {height} pixels"));
        }
        Ok(Some(Self { width, height, start: at + 1 }))
    }

    /// Length of header and pixels together.
    pub fn end(self) -> usize {
        self.start + self.width as usize * self.height as usize * 3
    }
}

/// Decodes the picture at the beginning of the bytes, after `check_size` has accepted its width and height.
///
/// # Errors
/// The data are not a complete picture; the errors of `check_size`.
pub(crate) fn decode_ppm(
    bytes: &[u8],
    check_size: impl FnOnce(u32, u32) -> Result<(), PictureError>,
) -> Result<RgbImage, PictureError> {
    let damaged = |found: String| PictureError::DamagedImage { format: "PPM", reason: format!("found {found}") };
    let short = || damaged(format!("a PPM that ends after {} bytes", bytes.len()));
    let head = PpmHead::read(bytes).map_err(damaged)?.ok_or_else(short)?;
    check_size(head.width, head.height)?;
    let pixels = bytes.get(head.start..head.end()).ok_or_else(short)?;
    RgbImage::from_raw(head.width, head.height, pixels.to_vec()).ok_or_else(short)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ppm_heads_have_comments_and_bounds() {
        let decode = |bytes: &[u8]| decode_ppm(bytes, |_, _| Ok(()));
        let picture = decode(b"P6 # two\n# pixels\n2 1\n255\n\x01\x02\x03\x04\x05\x06").unwrap();
        assert_eq!((picture.dimensions(), picture.as_raw().as_slice()), ((2, 1), [1, 2, 3, 4, 5, 6].as_slice()));
        for (bytes, expected) in [
            (b"P6 2 1 255\n\x01\x02\x03".as_slice(), "ends after 14 bytes"),
            (b"P6 2 1 65535\n", "the maximum value 65535"),
            (b"P6 0 1 255\n", "0 × 1"),
            (b"P6 16384 16384 255\n", "16384 × 16384"),
            (b"P6 1 16385 255\n", "1 × 16385"),
            (b"P6 16385 1 255\n", "16385 × 1"),
            (b"P6 99999999999 1 255\n", "99999999999"),
            (b"P6 -2 1 255\n", "in place of a number"),
            (b"P6 2", "ends after 4 bytes"),
        ] {
            let error = decode(bytes).unwrap_err().to_string();
            assert!(error.contains(expected), "{error}");
        }
    }

    #[test]
    fn a_head_that_does_not_end_is_refused() {
        let head = |comment: usize| PpmHead::read(&[b"P6 #".as_slice(), &vec![b'x'; comment]].concat());
        assert_eq!(head(1000), Ok(None));
        assert!(head(1100).unwrap_err().contains("without the end of its header"));
    }
}
