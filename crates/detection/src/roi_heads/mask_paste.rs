//! Converts the mask of a box to a mask of the image.

use sdg_geometry::{BoundingBox, Mask};

use crate::config::MaskPasting;

/// The probabilities of one detection's mask, `S×S`, row by row, stretched over its box.
#[derive(Debug, Clone, PartialEq)]
pub struct BoxMask {
    /// Number of cells along each side.
    pub size: usize,
    /// Values from 0 to 1.
    pub probabilities: Vec<f32>,
}

impl BoxMask {
    /// The mask on an image of `width × height` pixels: the pixels with a probability of at least `threshold`; for
    /// [`MaskPasting::WholePixels`], those with a probability above it.
    ///
    /// `bounds` is in pixels of that image.
    pub fn paste(&self, bounds: &BoundingBox, width: u32, height: u32, threshold: f64, pasting: MaskPasting) -> Mask {
        assert_eq!(self.probabilities.len(), self.size * self.size, "expected a square mask");
        match pasting {
            MaskPasting::PixelCenters => self.paste_pixel_centers(bounds, width, height, threshold as f32),
            MaskPasting::WholePixels => self.paste_whole_pixels(bounds, width, height, threshold as f32),
        }
    }

    /// The mask by [`MaskPasting::PixelCenters`].
    ///
    /// # Source
    /// Detectron2's `paste_masks_in_image`: bilinear, zeros outside; the mask has the pixels with at least the
    /// threshold.
    fn paste_pixel_centers(&self, bounds: &BoundingBox, width: u32, height: u32, threshold: f32) -> Mask {
        let (x1, y1, x2, y2) = (bounds.x1 as f32, bounds.y1 as f32, bounds.x2 as f32, bounds.y2 as f32);
        let mut mask = Mask::empty(width, height);
        // By interpolation an outer cell extends beyond the box, by at most half of its own size.
        let cells = |low: f32, high: f32, extent: u32| -> (u32, Vec<f32>) {
            let reach = (high - low) / self.size as f32;
            let first = (low - reach).floor().clamp(0.0, extent as f32) as u32;
            let end = (high + reach).ceil().clamp(0.0, extent as f32) as u32;
            let cell = |pixel: u32| (pixel as f32 + 0.5 - low) / (high - low) * self.size as f32 - 0.5;
            (first, (first..end).map(cell).collect())
        };
        let (first_column, columns) = cells(x1, x2, width);
        let (first_row, rows) = cells(y1, y2, height);
        for (y, row) in (first_row..).zip(&rows) {
            for (x, column) in (first_column..).zip(&columns) {
                if self.bilinear_or_zero(*column, *row) >= threshold {
                    mask.set(x, y, true);
                }
            }
        }
        mask
    }

    /// The value at a position in cells (centres at integers); cells outside are zero.
    fn bilinear_or_zero(&self, column: f32, row: f32) -> f32 {
        let (left, top) = (column.floor(), row.floor());
        let (fx, fy) = (column - left, row - top);
        let cell = |dx: i64, dy: i64| {
            let (x, y) = (left as i64 + dx, top as i64 + dy);
            let inside = (0..self.size as i64).contains(&x) && (0..self.size as i64).contains(&y);
            if inside { self.probabilities[y as usize * self.size + x as usize] } else { 0.0 }
        };
        blend([cell(0, 0), cell(1, 0), cell(0, 1), cell(1, 1)], fx, fy)
    }

    /// The mask by [`MaskPasting::WholePixels`].
    ///
    /// # Source
    /// torchvision's `paste_masks_in_image`: the mask is padded, and its box is enlarged by the same factor. The
    /// corners of the box are truncated to whole pixels, and both corner pixels belong to the box. The mask has the
    /// pixels above the threshold, as in torchvision's examples.
    fn paste_whole_pixels(&self, bounds: &BoundingBox, width: u32, height: u32, threshold: f32) -> Mask {
        let padded = self.padded();
        let enlarged = padded.size as f32 / self.size as f32;
        let span = |low: f64, high: f64| -> (i64, usize) {
            let (low, high) = (low as f32, high as f32);
            let (half, center) = ((high - low) * 0.5 * enlarged, (high + low) * 0.5);
            // Rounds towards zero, like a conversion to integers.
            let (low, high) = ((center - half) as i64, (center + half) as i64);
            (low, (high - low + 1).max(1) as usize)
        };
        let (left, columns) = span(bounds.x1, bounds.x2);
        let (top, rows) = span(bounds.y1, bounds.y2);
        let taps = |count: usize| -> Vec<(usize, usize, f32)> {
            let scale = padded.size as f32 / count as f32;
            (0..count)
                .map(|i| {
                    let at = ((i as f32 + 0.5) * scale - 0.5).max(0.0);
                    let first = (at as usize).min(padded.size - 1);
                    (first, (first + 1).min(padded.size - 1), at - first as f32)
                })
                .collect()
        };
        let (along_x, along_y) = (taps(columns), taps(rows));
        let mut mask = Mask::empty(width, height);
        let on_image = |at: i64, extent: u32| (0..i64::from(extent)).contains(&at).then_some(at as u32);
        for (y, (y0, y1, fy)) in (top..).zip(&along_y) {
            let Some(y) = on_image(y, height) else { continue };
            for (x, (x0, x1, fx)) in (left..).zip(&along_x) {
                let Some(x) = on_image(x, width) else { continue };
                let at = |row: usize, column: usize| padded.probabilities[row * padded.size + column];
                if blend([at(*y0, *x0), at(*y0, *x1), at(*y1, *x0), at(*y1, *x1)], *fx, *fy) > threshold {
                    mask.set(x, y, true);
                }
            }
        }
        mask
    }

    /// The mask with one more zero cell on each side.
    fn padded(&self) -> Self {
        let size = self.size + 2;
        let mut probabilities = vec![0f32; size * size];
        for (row, values) in self.probabilities.chunks_exact(self.size).enumerate() {
            probabilities[(row + 1) * size + 1..][..self.size].copy_from_slice(values);
        }
        Self { size, probabilities }
    }
}

/// Interpolates between four cells, upper left first: fraction `fx` towards the right, fraction `fy` downwards.
///
/// The interpolation of `sdg-shape` is not used: it reads pixels of three bytes, and a cell is one probability. Both
/// reference implementations sum in the order of this function.
fn blend([a, b, c, d]: [f32; 4], fx: f32, fy: f32) -> f32 {
    (a * (1.0 - fx) + b * fx) * (1.0 - fy) + (c * (1.0 - fx) + d * fx) * fy
}

#[cfg(test)]
mod tests {
    use super::*;

    fn full() -> BoxMask {
        BoxMask { size: 28, probabilities: vec![1.0; 28 * 28] }
    }

    const BOUNDS: BoundingBox = BoundingBox { x1: 4.0, y1: 6.0, x2: 14.0, y2: 10.0 };

    #[test]
    fn a_full_mask_fills_its_box() {
        let mask = full().paste(&BOUNDS, 20, 20, 0.5, MaskPasting::PixelCenters);
        assert_eq!((mask.area(), mask.bounds()), (40, Some(BOUNDS)));
    }

    #[test]
    fn whole_pixels_take_the_last_one_in() {
        // The padded box is 10·30/28 wide: from 3 (3.64) to 14 (14.36), 12 pixels for 30 cells; the outermost columns
        // are read a quarter of a cell outside the first cell's centre and have the value 0.75. In y the box extends
        // from 5 to 10 in the same way.
        let mask = full().paste(&BOUNDS, 20, 20, 0.5, MaskPasting::WholePixels);
        assert_eq!(mask.bounds(), Some(BoundingBox { x1: 3.0, y1: 5.0, x2: 15.0, y2: 11.0 }));
    }

    #[test]
    fn half_a_mask_and_a_box_beyond_the_border() {
        let left_half = BoxMask { size: 2, probabilities: vec![1.0, 0.0, 1.0, 0.0] };
        let bounds = BoundingBox { x1: -2.0, y1: 0.0, x2: 6.0, y2: 4.0 };
        for pasting in [MaskPasting::PixelCenters, MaskPasting::WholePixels] {
            let mask = left_half.paste(&bounds, 5, 3, 0.5, pasting);
            assert!(mask.get(0, 1) && !mask.get(3, 1), "{pasting:?}");
        }
    }

    #[test]
    fn the_threshold_decides() {
        let even = BoxMask { size: 28, probabilities: vec![0.6; 28 * 28] };
        for pasting in [MaskPasting::PixelCenters, MaskPasting::WholePixels] {
            assert_eq!(even.paste(&BOUNDS, 20, 20, 0.7, pasting).area(), 0);
            assert!(even.paste(&BOUNDS, 20, 20, 0.5, pasting).area() >= 16);
        }
    }
}
