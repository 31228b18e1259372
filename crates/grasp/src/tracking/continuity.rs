//! Whether a frame continues the one before.

use image::RgbImage;
use sdg_geometry::BoundingBox;

use sdg_shape::PixelRect;

/// Maximum number of cells, horizontally and vertically, whose mean colours are compared. Chosen by hand.
const MAX_CELLS: [u32; 2] = [32, 24];
/// Minimum length of a cell's shorter side: the mean of fewer pixels would be noise. Chosen by hand.
const MIN_CELL_PX: u32 = 8;
/// Maximum number of pixels, horizontally and vertically, from which a cell's mean is computed: more would take longer
/// than following a part.
const MAX_SAMPLES: u32 = 20;
/// Maximum change of a mean, in grey values, without a change of objects. Chosen by hand: above the changes by noise
/// and lamps, below the change by a part that covers a tenth of a cell.
const MAX_CHANGE: f32 = 6.0;

/// The mean colours of the cells of a picture, or of its searched region.
#[derive(Debug, Clone)]
pub(super) struct CoarseView {
    window: PixelRect,
    /// Number of cells, horizontally and vertically.
    cells: [u32; 2],
    means: Vec<[f32; 3]>,
}

impl CoarseView {
    pub(super) fn new(picture: &RgbImage, window: &PixelRect) -> Self {
        let size = [window.width, window.height];
        let cells = [0, 1].map(|axis| (size[axis] / MIN_CELL_PX).clamp(1, MAX_CELLS[axis]));
        let places = (0..cells[1]).flat_map(|row| (0..cells[0]).map(move |column| [column, row]));
        Self { window: *window, cells, means: places.map(|cell| mean(picture, window, cells, cell)).collect() }
    }

    /// Whether the picture has changed outside the boxes and a border of one cell around each.
    pub(super) fn has_changed_beside(&self, before: &Self, boxes: &[BoundingBox]) -> bool {
        let PixelRect { left, top, width, height } = self.window;
        let [left, top] = [left, top].map(f64::from);
        let [columns, rows] = self.cells;
        let (width, height) = (f64::from(width) / f64::from(columns), f64::from(height) / f64::from(rows));
        let is_beside = |idx: usize| {
            let [column, row] = [idx % columns as usize, idx / columns as usize].map(|cell| cell as f64);
            let touches = |part: &BoundingBox| {
                (part.x1 - width..part.x2 + width).contains(&(left + (column + 0.5) * width))
                    && (part.y1 - height..part.y2 + height).contains(&(top + (row + 0.5) * height))
            };
            !boxes.iter().any(touches)
        };
        let has_changed = |(one, other): (&[f32; 3], &[f32; 3])| (0..3).any(|c| (one[c] - other[c]).abs() > MAX_CHANGE);
        self.means.iter().zip(&before.means).enumerate().any(|(idx, means)| has_changed(means) && is_beside(idx))
    }
}

fn mean(picture: &RgbImage, window: &PixelRect, cells: [u32; 2], cell: [u32; 2]) -> [f32; 3] {
    let (corner, size) = ([window.left, window.top], [window.width, window.height]);
    let [from, to] = [0, 1].map(|end| [0, 1].map(|axis| corner[axis] + (cell[axis] + end) * size[axis] / cells[axis]));
    let steps = [0, 1].map(|axis| (to[axis] - from[axis]).div_ceil(MAX_SAMPLES).max(1) as usize);
    let (mut sum, mut count) = ([0_u32; 3], 0_u32);
    for y in (from[1]..to[1]).step_by(steps[1]) {
        for x in (from[0]..to[0]).step_by(steps[0]) {
            let pixel = picture.get_pixel(x, y).0;
            (0..3).for_each(|c| sum[c] += u32::from(pixel[c]));
            count += 1;
        }
    }
    sum.map(|sum| sum as f32 / count.max(1) as f32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::Rgb;

    fn whole(picture: &RgbImage) -> PixelRect {
        PixelRect { left: 0, top: 0, width: picture.width(), height: picture.height() }
    }

    #[test]
    fn noise_is_no_change_and_another_thing_is_one_unless_a_part_lies_there() {
        let noisy = |seed: u32| {
            RgbImage::from_fn(640, 480, |x, y| {
                let noise =
                    (x.wrapping_mul(31) ^ y.wrapping_mul(17) ^ seed.wrapping_mul(97)).wrapping_mul(2_654_435_761);
                Rgb([90 + (noise >> 28) as u8; 3])
            })
        };
        let view = |picture: &RgbImage| CoarseView::new(picture, &whole(picture));
        let before = view(&noisy(1));
        assert!(!view(&noisy(2)).has_changed_beside(&before, &[]));
        let mut other = noisy(2);
        (100..130).for_each(|y| (200..230).for_each(|x| other.put_pixel(x, y, Rgb([150; 3]))));
        let after = view(&other);
        assert!(after.has_changed_beside(&before, &[]));
        let on = |x1: f64| BoundingBox { x1, y1: 100.0, x2: x1 + 30.0, y2: 130.0 };
        assert!(!after.has_changed_beside(&before, &[on(200.0)]));
        assert!(after.has_changed_beside(&before, &[on(300.0)]));
        // Fewer pixels than cells.
        assert!(!view(&RgbImage::new(5, 3)).has_changed_beside(&view(&RgbImage::new(5, 3)), &[]));
        // Changes count only in the searched region; boxes are in pixels of the picture.
        let seen = |left: u32| {
            let window = PixelRect { left, top: 80, width: 64, height: 48 };
            [noisy(1), other.clone()].map(|picture| CoarseView::new(&picture, &window))
        };
        let [before, after] = seen(400);
        assert!(!after.has_changed_beside(&before, &[]));
        let [before, after] = seen(190);
        assert!(after.has_changed_beside(&before, &[]) && !after.has_changed_beside(&before, &[on(200.0)]));
    }
}
