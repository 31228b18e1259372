//! Colours between the pixels of a picture, by bilinear interpolation, many at once.
//!
//! Other interpolation loops, each with its reason beside it: [`GradientField`](crate::GradientField) (directions,
//! three floats), `sdg-demonstration`'s raster (repeats the border), `sdg-orientation`'s crop (a fixed colour beyond
//! the border; trained weights depend on the exact bits of its results), `sdg-detection`'s pasted masks (single
//! numbers).

use image::RgbImage;
use wide::{f32x4, i32x4};

use crate::gradient_field::whole;
use crate::lanes::{larger, smaller};

/// A picture whose colours are interpolated between its pixels.
#[derive(Clone, Copy)]
pub(crate) struct PixelReader<'a> {
    raw: &'a [u8],
    width: u32,
    /// Column and row of the last pixel that has a neighbour; below 0 if there is none.
    last_pair: [f32; 2],
}

impl<'a> PixelReader<'a> {
    pub(crate) fn new(image: &'a RgbImage) -> Self {
        let (width, height) = image.dimensions();
        Self { raw: image.as_raw(), width, last_pair: [width, height].map(|side| side as f32 - 2.0) }
    }

    /// The colours `[r, g, b, _]`, from 0 to 255, at places in pixels; zeros for a place that does not lie between four
    /// pixel centres. Also returns 1 for places that do and 0 for others.
    #[inline(always)]
    pub(crate) fn colors<const N: usize>(&self, x: &[f32; N], y: &[f32; N], out: &mut [f32x4; N]) -> [f32; N] {
        let mut inside = [0.0; N];
        let [right, bottom] = self.last_pair;
        for k in 0..N {
            let (u, v) = (x[k] - 0.5, y[k] - 0.5);
            let is_inside = (u >= 0.0) & (v >= 0.0) & (u < right + 1.0) & (v < bottom + 1.0);
            inside[k] = if is_inside { 1.0 } else { 0.0 };
        }
        self.colors_to_border(x, y, out);
        for k in 0..N {
            out[k] *= f32x4::splat(inside[k]);
        }
        inside
    }

    /// The colours as [`Self::colors`] returns them, but a place beyond the border gets the colour of the nearest
    /// pixel. A coordinate that is not a number counts as 0.
    #[inline(always)]
    pub(crate) fn colors_to_border<const N: usize>(&self, x: &[f32; N], y: &[f32; N], out: &mut [f32x4; N]) {
        let (mut along, mut below, mut idxs) = ([0.0; N], [0.0; N], [0u32; N]);
        let [right, bottom] = self.last_pair;
        for k in 0..N {
            let u = smaller(larger(x[k] - 0.5, 0.0), right + 1.0);
            let v = smaller(larger(y[k] - 0.5, 0.0), bottom + 1.0);
            let (col, row) = (larger(smaller(u.floor(), right), 0.0), larger(smaller(v.floor(), bottom), 0.0));
            along[k] = u - col;
            below[k] = v - row;
            idxs[k] = whole(row).wrapping_mul(self.width).wrapping_add(whole(col));
        }
        for k in 0..N {
            let at = 3 * idxs[k] as usize;
            let (upper, lower) = (self.pair(at), self.pair(at + 3 * self.width as usize));
            let row = |[left, right]: [f32x4; 2]| left + f32x4::splat(along[k]) * (right - left);
            let (upper, lower) = (row(upper), row(lower));
            out[k] = upper + f32x4::splat(below[k]) * (lower - upper);
        }
    }

    /// A pixel and its right neighbour, each with an unused fourth number: four bytes are read at once.
    #[inline(always)]
    fn pair(&self, at: usize) -> [f32x4; 2] {
        let color = |[a, b, c, d]: [u8; 4]| f32x4::from_i32x4(i32x4::new([a, b, c, d].map(i32::from)));
        match self.raw.get(at..at + 7) {
            Some(&[a, b, c, d, e, f, g]) => [color([a, b, c, d]), color([d, e, f, g])],
            // The last two pixels of the picture.
            _ => match self.raw.get(at..at + 6) {
                Some(&[a, b, c, d, e, f]) => [color([a, b, c, d]), color([d, e, f, 0])],
                _ => [f32x4::ZERO; 2],
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::Rgb;

    #[test]
    fn between_four_pixels_by_hand() {
        let image = RgbImage::from_fn(2, 2, |x, y| Rgb([(100 * x + 40 * y) as u8, 7, 0]));
        let mut colors = [f32x4::ZERO; 4];
        let inside = PixelReader::new(&image).colors(&[0.75, 0.4, 1.5, f32::NAN], &[1.0, 1.0, 1.0, 1.0], &mut colors);
        assert_eq!(inside, [1.0, 0.0, 0.0, 0.0]);
        assert_eq!(colors[0].to_array()[..3], [45.0, 7.0, 0.0]);
        assert_eq!(colors[1..], [f32x4::ZERO; 3]);
    }

    #[test]
    fn a_picture_of_one_pixel_has_nothing_between() {
        let image = RgbImage::from_pixel(1, 1, Rgb([9; 3]));
        let mut colors = [f32x4::ZERO; 1];
        assert_eq!(PixelReader::new(&image).colors(&[0.5], &[0.5], &mut colors), [0.0]);
    }
}
