//! Whether a picture has colours. In a picture without colours, from a monochrome camera, parts are compared with the
//! photo in grey.

use image::buffer::ConvertBuffer;
use image::{GrayImage, RgbImage};

/// Whether a picture has colours.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Colors {
    There,
    None,
}

impl Colors {
    /// Decides by the pixels: without colours, the three values of a pixel are equal up to rounding.
    pub(crate) fn of(image: &RgbImage) -> Self {
        /// Maximum difference that JPEG's colour conversion leaves in a grey pixel.
        const ROUNDING: u8 = 2;
        let is_gray = |[r, g, b]: [u8; 3]| r.max(g).max(b) - r.min(g).min(b) <= ROUNDING;
        if image.pixels().all(|pixel| is_gray(pixel.0)) { Self::None } else { Self::There }
    }
}

/// The picture as a monochrome camera would record it.
pub(crate) fn gray(image: &RgbImage) -> RgbImage {
    let gray: GrayImage = image.convert();
    gray.convert()
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::Rgb;

    #[test]
    fn one_coloured_pixel_makes_a_picture_of_colours() {
        let mut image = RgbImage::from_fn(40, 30, |x, y| Rgb([(x + y) as u8 * 3; 3]));
        assert_eq!(Colors::of(&image), Colors::None);
        image.put_pixel(39, 29, Rgb([90, 120, 90]));
        assert_eq!(Colors::of(&image), Colors::There);
        assert_eq!(Colors::of(&gray(&image)), Colors::None);
    }
}
