//! The four pixels around a point, for bilinear interpolation.
//!
//! Loops of their own, each with its reason beside it: [`GradientField`](crate::GradientField) (directions, three floats),
//! `sdg-grasp`'s plan view and `sdg-demonstration`'s raster (the border goes on), `sdg-orientation`'s crop (beyond the border a
//! colour; weights belong to its bits), `sdg-detection`'s pasted masks (single numbers).

use image::RgbImage;
use nalgebra::Point2;

/// The pixels around a point, and where it lies between their centres.
pub(crate) struct PixelCell<'a> {
    /// Left and right pixel of the row above, and of the row below: `[r, g, b, r, g, b]`.
    upper: &'a [u8],
    lower: &'a [u8],
    /// From the left pixels to the right ones and from the upper to the lower ones, in [0, 1).
    along: f64,
    below: f64,
}

impl<'a> PixelCell<'a> {
    /// `None` where the point does not lie between four pixel centres.
    #[inline]
    pub(crate) fn at(image: &'a RgbImage, point: &Point2<f64>) -> Option<Self> {
        let (x, y) = (point.x - 0.5, point.y - 0.5);
        let [width, height] = [image.width(), image.height()];
        if !(x >= 0.0 && y >= 0.0 && x < f64::from(width) && y < f64::from(height)) {
            return None;
        }
        // Rounded down, as neither is negative: without SSE4 `floor` is a call.
        let (left, top) = (x as i32, y as i32);
        if left as u32 + 1 >= width || top as u32 + 1 >= height {
            return None;
        }
        let at = 3 * (top as usize * width as usize + left as usize);
        let raw = image.as_raw();
        let (upper, lower) = (&raw[at..][..6], &raw[at + 3 * width as usize..][..6]);
        Some(Self { upper, lower, along: x - f64::from(left), below: y - f64::from(top) })
    }

    /// The colour in single precision.
    #[inline]
    pub(crate) fn color_f32(&self) -> [f32; 3] {
        let (along, below) = (self.along as f32, self.below as f32);
        std::array::from_fn(|c| {
            let row = |row: &[u8]| (1.0 - along) * f32::from(row[c]) + along * f32::from(row[c + 3]);
            (1.0 - below) * row(self.upper) + below * row(self.lower)
        })
    }

    /// The colour in double precision.
    #[inline]
    pub(crate) fn color_f64(&self) -> [f64; 3] {
        let (along, down) = (self.along, self.below);
        let weights = [(1.0 - along) * (1.0 - down), along * (1.0 - down), (1.0 - along) * down, along * down];
        let pixels = [&self.upper[..3], &self.upper[3..], &self.lower[..3], &self.lower[3..]];
        let mut color = [0.0; 3];
        for (pixel, weight) in pixels.into_iter().zip(weights) {
            (0..3).for_each(|c| color[c] += weight * f64::from(pixel[c]));
        }
        color
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::Rgb;

    #[test]
    fn between_four_pixels_by_hand() {
        let image = RgbImage::from_fn(2, 2, |x, y| Rgb([(100 * x + 40 * y) as u8, 7, 0]));
        let cell = PixelCell::at(&image, &Point2::new(0.75, 1.0)).unwrap();
        assert_eq!(cell.color_f64(), [45.0, 7.0, 0.0]);
        assert_eq!(cell.color_f32(), [45.0, 7.0, 0.0]);
        assert!(PixelCell::at(&image, &Point2::new(0.4, 1.0)).is_none());
        assert!(PixelCell::at(&image, &Point2::new(1.5, 1.0)).is_none());
        assert!(PixelCell::at(&image, &Point2::new(f64::NAN, 1.0)).is_none());
    }
}
