//! An image with its halved copies, for a caller that crops many windows of it.

use std::sync::OnceLock;

use image::RgbImage;
use nalgebra::Point2;

use crate::crop::CropWindow;

/// Maximum number of halvings: more would leave almost nothing of a photo.
const MAX_HALVINGS: usize = 6;

/// An image with its halved copies, each computed on first use.
#[derive(Debug)]
pub struct Pyramid<'a> {
    image: &'a RgbImage,
    halves: [OnceLock<RgbImage>; MAX_HALVINGS],
}

impl<'a> Pyramid<'a> {
    /// Makes a pyramid of an image; no copy is computed yet.
    pub fn new(image: &'a RgbImage) -> Self {
        Self { image, halves: Default::default() }
    }

    fn level(&self, halvings: usize) -> &RgbImage {
        match halvings.checked_sub(1) {
            None => self.image,
            Some(above) => self.halves[above].get_or_init(|| halved(self.level(above))),
        }
    }

    /// Resamples a window of the image to `size_px` × `size_px` pixels, like [`CropWindow::read`], but from the
    /// smallest copy that has at least one pixel per pixel of the crop. For a large window this takes a fraction of the
    /// time. The colours differ by rounding and by the averaging of a pixel's area; the image's border is blurred by up
    /// to two of the crop's pixels.
    pub fn read(&self, window: &CropWindow, size_px: u32) -> RgbImage {
        let (mut halvings, mut scale) = (0, window.side / f64::from(size_px));
        while scale >= 2.0 && halvings < MAX_HALVINGS {
            (halvings, scale) = (halvings + 1, 0.5 * scale);
        }
        let factor = 0.5f64.powi(halvings as i32);
        let center = Point2::from(factor * window.center.coords);
        CropWindow { center, side: factor * window.side, ..*window }.read(self.level(halvings), size_px)
    }
}

/// Halves an image by the mean of 2×2 pixels; an odd last row or column is left out, so positions are exactly halved.
pub fn halved(image: &RgbImage) -> RgbImage {
    let (width, height) = (image.width() / 2, image.height() / 2);
    let stride = 3 * image.width() as usize;
    let mut out = Vec::with_capacity(3 * (width * height) as usize);
    for rows in image.as_raw().chunks_exact(2 * stride.max(1)).take(height as usize) {
        let (above, below) = rows.split_at(stride);
        for (a, b) in above.chunks_exact(6).zip(below.chunks_exact(6)) {
            out.extend((0..3).map(|c| {
                let sum = u16::from(a[c]) + u16::from(a[c + 3]) + u16::from(b[c]) + u16::from(b[c + 3]);
                ((sum + 2) / 4) as u8
            }));
        }
    }
    RgbImage::from_raw(width, height, out).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::Rgb;
    use sdg_geometry::Angle;

    #[test]
    fn a_large_window_shows_what_it_shows_read_from_the_image_itself() {
        // Waves of several pixels of the crop, because finer ones are averaged differently.
        let image = RgbImage::from_fn(901, 803, |x, y| {
            let wave = |t: f64| (127.0 + 120.0 * t.sin()) as u8;
            Rgb([wave(f64::from(x) / 20.0), wave(f64::from(x + 2 * y) / 60.0), wave(f64::from(y) / 25.0)])
        });
        let pyramid = Pyramid::new(&image);
        for (side, turn, within) in [(60.0, 12.0, 0.0), (150.0, 40.0, 3.0), (290.0, 75.0, 3.0), (560.0, -20.0, 3.0)] {
            let window = CropWindow { center: Point2::new(440.0, 410.0), side, turn: Angle::from_degrees(turn) };
            let (exact, read) = (window.read(&image, 48), pyramid.read(&window, 48));
            let differences = exact.as_raw().iter().zip(read.as_raw()).map(|(a, b)| f64::from(a.abs_diff(*b)));
            let mean = differences.sum::<f64>() / exact.as_raw().len() as f64;
            assert!(mean <= within, "{side}: {mean}");
        }
        // The image is too small to be halved this often; beyond its border the colour is the mean colour.
        let tiny = RgbImage::new(3, 2);
        let window = CropWindow { center: Point2::new(1.0, 1.0), side: 900.0, turn: Angle::ZERO };
        assert_eq!(Pyramid::new(&tiny).read(&window, 2).dimensions(), (2, 2));
    }
}
