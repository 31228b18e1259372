//! The target of the mask head: an object's outline as a square over a box.
//!
//! Shapes: S side of a mask, R ROIs.

use burn::tensor::{Device, Tensor, TensorData};
use sdg_geometry::{Mask, Polygon};
use sdg_kernels::{RoiAlignParams, RoiAlignment, SamplingRatio, roi_align};

use crate::boxes::Corners;
use crate::config::MaskTargets;
use crate::host::host_values;
use crate::target::{ObjectMask, union};

/// Sub-cells of a cell along each axis in COCO's rasteriser.
const SUBCELLS: f64 = 5.0;

/// Minimum side of a box over which a mask is stretched, in pixels; smaller boxes would give huge factors.
const MIN_SIDE_PX: f32 = 0.1;

/// Returns the target mask of an object over a box, `S·S` values from 0 to 1, row by row.
///
/// `mask` and `roi` are in pixels of the resized image, which has `[height, width]` pixels.
///
/// # Source
/// Detectron2's `PolygonMasks.crop_and_resize` and `BitMasks.crop_and_resize`; torchvision's
/// `project_masks_on_boxes`.
pub fn encode(mask: &ObjectMask, roi: &Corners, image_size: [usize; 2], size: usize, kind: MaskTargets) -> Vec<f32> {
    match (kind, mask) {
        (MaskTargets::Rasterized, ObjectMask::Polygons(polygons)) => {
            let inside = rasterize_in_box(polygons, roi, size);
            inside.into_iter().map(|inside| f32::from(u8::from(inside))).collect()
        }
        (MaskTargets::Rasterized, ObjectMask::Bitmap(bitmap)) => {
            let pooled = pool_mask(bitmap, roi, size, RoiAlignment::HalfPixel);
            pooled.into_iter().map(|part| f32::from(u8::from(part >= 0.5))).collect()
        }
        (MaskTargets::Pooled, ObjectMask::Bitmap(bitmap)) => pool_mask(bitmap, roi, size, RoiAlignment::Legacy),
        (MaskTargets::Pooled, ObjectMask::Polygons(polygons)) => {
            let [height, width] = image_size;
            pool_mask(&union(polygons, width as u32, height as u32), roi, size, RoiAlignment::Legacy)
        }
    }
}

fn pool_mask(mask: &Mask, roi: &Corners, size: usize, alignment: RoiAlignment) -> Vec<f32> {
    // A device without autodiff: the target has no gradient, and its crop is small.
    let device = Device::flex();
    let (width, height) = (mask.width(), mask.height());
    let values: Vec<f32> =
        (0..height).flat_map(|y| (0..width).map(move |x| f32::from(u8::from(mask.get(x, y))))).collect();
    let map = Tensor::<4>::from_data(TensorData::new(values, [1, 1, height as usize, width as usize]), &device);
    let [x1, y1, x2, y2] = *roi;
    let rois = Tensor::<2>::from_data(TensorData::new(vec![0.0, x1, y1, x2, y2], [1, 5]), &device);
    let params = RoiAlignParams {
        output_size: [size; 2],
        spatial_scale: 1.0,
        sampling_ratio: SamplingRatio::Adaptive,
        alignment,
    };
    host_values(roi_align(map, rois, params))
}

/// Fills polygons, stretched from a box to `S×S` cells, as the union of their areas.
fn rasterize_in_box(polygons: &[Polygon], roi: &Corners, size: usize) -> Vec<bool> {
    let scale = |low: f32, high: f32| f64::from(size as f32 / (high - low).max(MIN_SIDE_PX));
    let (scale_x, scale_y) = (scale(roi[0], roi[2]), scale(roi[1], roi[3]));
    let mut inside = vec![false; size * size];
    for polygon in polygons {
        let stretched: Vec<[f64; 2]> = polygon
            .vertices
            .iter()
            .map(|v| [(v.x - f64::from(roi[0])) * scale_x, (v.y - f64::from(roi[1])) * scale_y])
            .collect();
        fill_as_coco(&stretched, size, &mut inside);
    }
    inside
}

/// Fills a polygon, given in cells, like COCO's run-length coder: by the even-odd rule along columns.
///
/// Vertices are rounded to a grid of fifths of a cell and joined by digital lines. Where a line steps across the
/// centre of a column, the column changes between outside and inside.
///
/// # Source
/// The behaviour of COCO's `rleFrPoly`, including rounding towards zero, on which Detectron2's mask loss is based.
fn fill_as_coco(vertices: &[[f64; 2]], size: usize, inside: &mut [bool]) {
    let grid: Vec<[i64; 2]> = vertices.iter().map(|v| v.map(|x| (SUBCELLS * x + 0.5) as i64)).collect();
    let mut turns: Vec<Vec<usize>> = vec![Vec::new(); size];
    for (idx, from) in grid.iter().enumerate() {
        digital_line(*from, grid[(idx + 1) % grid.len()], |before, after| {
            note_turn(before, after, size, &mut turns);
        });
    }
    for (column, rows) in turns.iter_mut().enumerate() {
        rows.sort_unstable();
        for span in rows.chunks(2) {
            let end = span.get(1).copied().unwrap_or(size);
            for row in span[0]..end {
                inside[row * size + column] = true;
            }
        }
    }
}

/// Steps from one grid point to another along the longer axis, and calls `step` with the ends of each step.
fn digital_line(from: [i64; 2], to: [i64; 2], mut step: impl FnMut([i64; 2], [i64; 2])) {
    let lengths = [0, 1].map(|axis| (to[axis] - from[axis]).abs());
    let (long, short) = if lengths[0] >= lengths[1] { (0, 1) } else { (1, 0) };
    let count = lengths[long];
    // Always computed from the lower end, so that a line is the same in both directions.
    let (low, high) = if from[long] <= to[long] { (from, to) } else { (to, from) };
    let slope = if count == 0 { 0.0 } else { (high[short] - low[short]) as f64 / count as f64 };
    let point = |t: i64| {
        let mut at = [0; 2];
        at[long] = low[long] + t;
        at[short] = (low[short] as f64 + slope * t as f64 + 0.5) as i64;
        at
    };
    let forwards = low == from;
    for t in 0..count {
        if forwards { step(point(t), point(t + 1)) } else { step(point(count - t), point(count - t - 1)) }
    }
}

/// Records the row at which a step across the centre of a column switches the column between outside and inside.
fn note_turn(before: [i64; 2], after: [i64; 2], size: usize, turns: &mut [Vec<usize>]) {
    if before[0] == after[0] {
        return;
    }
    let to_cells = |sub: i64| (sub as f64 + 0.5) / SUBCELLS - 0.5;
    let column = to_cells(before[0].min(after[0]));
    if column.fract() != 0.0 || column < 0.0 || column > (size - 1) as f64 {
        return;
    }
    let row = to_cells(before[1].min(after[1])).clamp(0.0, size as f64).ceil();
    turns[column as usize].push(row as usize);
}

#[cfg(test)]
mod tests {
    use super::*;
    use sdg_geometry::BoundingBox;

    fn square(x1: f64, y1: f64, x2: f64, y2: f64) -> Polygon {
        Polygon::from_box(&BoundingBox { x1, y1, x2, y2 })
    }

    #[test]
    fn a_rectangle_on_cell_borders_fills_its_cells() {
        // A box of 8 px over 4 cells; the rectangle covers the middle two columns, all rows.
        let roi = [10.0, 20.0, 18.0, 28.0];
        let inside = rasterize_in_box(&[square(12.0, 20.0, 16.0, 28.0)], &roi, 4);
        let row = [false, true, true, false];
        assert_eq!(inside, [row, row, row, row].concat());
    }

    #[test]
    fn two_polygons_are_joined_and_one_outside_adds_nothing() {
        let roi = [0.0, 0.0, 4.0, 4.0];
        let polygons = [square(0.0, 0.0, 1.0, 4.0), square(3.0, 0.0, 9.0, 2.0), square(-9.0, -9.0, -2.0, -2.0)];
        let inside = rasterize_in_box(&polygons, &roi, 4);
        let upper = [true, false, false, true];
        let lower = [true, false, false, false];
        assert_eq!(inside, [upper, upper, lower, lower].concat());
    }

    #[test]
    fn the_direction_of_turn_does_not_matter() {
        let triangle = [[1.3, 0.4], [10.9, 5.2], [3.1, 12.7]];
        let mut backwards = triangle;
        backwards.reverse();
        let filled = |vertices: &[[f64; 2]]| {
            let mut inside = vec![false; 14 * 14];
            fill_as_coco(vertices, 14, &mut inside);
            inside
        };
        assert_eq!(filled(&triangle), filled(&backwards));
        let area = filled(&triangle).iter().filter(|inside| **inside).count() as f64;
        // The area is half of the cross product of two edges. The tolerance is one cell along half of the outline.
        let exact = 0.5 * ((9.6 * 12.3) - (1.8 * 4.8));
        assert!((area - exact).abs() < 8.0, "{area} {exact}");
    }

    #[test]
    fn pooled_targets_keep_fractions_and_rasterized_ones_are_cut() {
        // The left quarter of an 8x8 image, pooled into 2x2 cells of 4x4 pixels, covers half of the left cells.
        let bitmap = ObjectMask::Bitmap(Mask::from_fn(8, 8, |x, _| x < 2));
        let roi = [0.0, 0.0, 8.0, 8.0];
        let legacy = encode(&bitmap, &roi, [8, 8], 2, MaskTargets::Pooled);
        // Without the shift by half a pixel, the samples lie between pixel centres: those at 0.5, 1.5, 2.5, 3.5 read 1,
        // 0.5, 0, 0.
        assert_eq!(legacy, [0.375, 0.0, 0.375, 0.0]);
        assert_eq!(encode(&bitmap, &roi, [8, 8], 2, MaskTargets::Rasterized), [1.0, 0.0, 1.0, 0.0]);
        let polygon = ObjectMask::Polygons(vec![square(0.0, 0.0, 2.0, 8.0)]);
        assert_eq!(encode(&polygon, &roi, [8, 8], 2, MaskTargets::Pooled), legacy);
    }
}
