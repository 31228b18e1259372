//! Decodes the bytes of one picture to pixels.

use image::RgbImage;
use sdg_picture::{ImageLimits, PixelFrame, decode_image_in};

/// Maximum width and height of a V4L2 camera's frames.
pub(crate) const MAX_SIDE: u32 = 1 << 14;
/// Maximum size of a camera's JPEG or PNG.
pub(crate) const MAX_ENCODED_BYTES: usize = 32 << 20;

/// The signature of PNG files.
pub(crate) const PNG_START: [u8; 8] = *b"\x89PNG\r\n\x1a\n";

/// Decodes one picture in the same way as a file of its format, which is recognised by the first bytes.
///
/// # Errors
/// Text that describes the data found instead of a complete picture.
pub fn decode(bytes: &[u8], frame: PixelFrame) -> Result<RgbImage, String> {
    decode_image_in(bytes, &ImageLimits::default(), frame).map_err(|error| error.to_string())
}

#[cfg(test)]
pub(crate) mod tests {
    use image::codecs::jpeg::JpegEncoder;
    use image::{Rgb, RgbImage};

    /// A JPEG of a picture with many colours and edges.
    pub(crate) fn jpeg(width: u32, height: u32) -> Vec<u8> {
        let picture = RgbImage::from_fn(width, height, |x, y| Rgb([(x * 7) as u8, (y * 5) as u8, (x * y) as u8]));
        let mut bytes = Vec::new();
        JpegEncoder::new_with_quality(&mut bytes, 90).encode_image(&picture).unwrap();
        bytes
    }
}
