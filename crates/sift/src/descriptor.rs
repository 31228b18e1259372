//! The descriptor of a keypoint: gradient directions on a 4 × 4 grid that rotates and scales with the keypoint.
//!
//! ```text
//! pixel ─► gradient, rotated by the keypoint's direction ─► distributed over 2 rows × 2 columns × 2 directions of the
//! 4 × 4 × 8 histogram, weighted by a Gaussian ─► unit length, clipped, unit length
//! ```

use std::f64::consts::TAU;

use pulp::{Simd, WithSimd};

use crate::DescriptorNormalization;
use crate::gradient::GradientRow;
use crate::orientation::Place;
use crate::scale_space::Octave;

/// Cells along a side of the grid.
const GRID: usize = 4;
/// Number of directions of a cell's histogram.
const NUM_DIRECTIONS: usize = 8;
/// Number of values in a descriptor.
pub const DESCRIPTOR_LENGTH: usize = GRID * GRID * NUM_DIRECTIONS;
/// Side of a cell, in units of the keypoint's σ.
const CELL_SIZE: f64 = 3.0;
/// Maximum value before the last normalisation, so that one strong edge does not dominate.
const CLIP: f32 = 0.2;
/// Maximum distance from the centre, in cells, at which a sample reaches a cell of the grid; slightly reduced, for
/// rounding.
const REACH: f64 = 0.5 * (GRID as f64 + 1.0) - 1e-4;
/// Cells along a side of the grid with its rim, which collects samples outside the grid.
const RIMMED: usize = GRID + 2;

/// Buffers for describing keypoints, in addition to the octave; reused from keypoint to keypoint.
#[derive(Default)]
pub(crate) struct Scratch {
    pub gradients: GradientRow,
    column_weights: Vec<f32>,
    samples: Samples,
}

/// The pixels of a row that reach the grid.
#[derive(Default)]
struct Samples {
    /// Row and column in the rimmed grid, at least 0 and below `RIMMED` - 1.
    row: Vec<f32>,
    column: Vec<f32>,
    /// Direction in eighths of a full rotation, from 0 to 8.
    direction: Vec<f32>,
    weight: Vec<f32>,
}

/// Describes one keypoint of direction `angle`, in radians. `None` if the area is flat.
///
/// # Source
/// Lowe 2004, section 6. The grid is centred on the keypoint itself, not on the nearest pixel.
pub(crate) struct Describe<'a> {
    pub octave: &'a Octave,
    pub place: Place,
    pub angle: f64,
    pub normalization: DescriptorNormalization,
    pub scratch: &'a mut Scratch,
}

impl WithSimd for Describe<'_> {
    type Output = Option<[f32; DESCRIPTOR_LENGTH]>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Self::Output {
        let Self { octave, place, angle, normalization, scratch } = self;
        let Scratch { gradients, column_weights, samples } = scratch;
        let image = &octave.levels[place.level];
        let cell = CELL_SIZE * place.sigma;
        let radius = REACH * cell * std::f64::consts::SQRT_2;
        let (sin, cos) = angle.sin_cos();
        // The window's σ is half the grid's side.
        let window_sigma = 0.5 * GRID as f64 * cell;
        let weight = |distance: f64| (-0.5 * (distance / window_sigma).powi(2)).exp() as f32;
        let window = |center: f64, size: usize| {
            let first = (center - radius).ceil().max(1.0) as usize;
            let last = (center + radius).floor().min(size as f64 - 2.0) as usize;
            (first, last)
        };
        let ((left, right), (top, bottom)) = (window(place.x, image.width()), window(place.y, image.height()));
        column_weights.clear();
        column_weights.extend((left..=right).map(|x| weight(x as f64 - place.x)));

        let mut histogram = Histogram::new();
        for y in top..=bottom {
            let dy = y as f64 - place.y;
            // The interval in which dx·cos + dy·sin and dy·cos - dx·sin are both within reach.
            let (a, b) = (span(cos, dy * sin, REACH * cell), span(-sin, dy * cos, REACH * cell));
            let first = (place.x + a.0.max(b.0)).ceil().max(left as f64);
            let last = (place.x + a.1.min(b.1)).floor().min(right as f64);
            if first > last {
                continue;
            }
            let (first, last) = (first as usize, last as usize);
            gradients.read(image.row(y - 1), image.row(y), image.row(y + 1), first, last);
            let row = RowInGrid {
                column_start: ((first as f64 - place.x) * cos + dy * sin) / cell,
                column_step: cos / cell,
                row_start: (dy * cos - (first as f64 - place.x) * sin) / cell,
                row_step: -sin / cell,
                angle,
                row_weight: weight(dy),
            };
            samples.read(&row, gradients, &column_weights[first - left..=last - left]);
            histogram.add(samples, last + 1 - first);
        }
        normalized(&histogram.grid(), normalization)
    }
}

/// The values of `t` for which |slope · t + start| is at most `reach`.
fn span(slope: f64, start: f64, reach: f64) -> (f64, f64) {
    if slope.abs() < 1e-9 {
        return if start.abs() <= reach { (f64::MIN, f64::MAX) } else { (f64::MAX, f64::MIN) };
    }
    let (a, b) = ((-reach - start) / slope, (reach - start) / slope);
    (a.min(b), a.max(b))
}

/// The part of an image row that crosses the grid, in cells from the grid's centre.
struct RowInGrid {
    column_start: f64,
    column_step: f64,
    row_start: f64,
    row_step: f64,
    angle: f64,
    row_weight: f32,
}

impl Samples {
    #[inline(always)]
    fn read(&mut self, line: &RowInGrid, gradients: &GradientRow, column_weights: &[f32]) {
        let n = column_weights.len();
        if self.row.len() < n {
            for values in [&mut self.row, &mut self.column, &mut self.direction, &mut self.weight] {
                values.resize(n, 0.0);
            }
        }
        let (row, column) = (&mut self.row[..n], &mut self.column[..n]);
        let (direction, weight) = (&mut self.direction[..n], &mut self.weight[..n]);
        let (magnitudes, directions) = (&gradients.magnitude[..n], &gradients.direction[..n]);
        // Cell centres are at whole numbers, the first cell of the rim at 0, so the grid's centre is at 2.5.
        let center = 0.5 * (RIMMED as f64 - 1.0);
        let (column_start, column_step) = ((line.column_start + center) as f32, line.column_step as f32);
        let (row_start, row_step) = ((line.row_start + center) as f32, line.row_step as f32);
        let per_radian = (NUM_DIRECTIONS as f64 / TAU) as f32;
        let turn = NUM_DIRECTIONS as f32;
        let zero = (line.angle.rem_euclid(TAU) * NUM_DIRECTIONS as f64 / TAU) as f32;
        for i in 0..n {
            let step = i as i32 as f32;
            column[i] = column_start + step * column_step;
            row[i] = row_start + step * row_step;
            let turned = directions[i] * per_radian - zero;
            direction[i] = if turned < 0.0 { turned + turn } else { turned };
            weight[i] = magnitudes[i] * (column_weights[i] * line.row_weight);
        }
    }
}

/// A cell of the grid.
type Cell = [f32; NUM_DIRECTIONS];

/// The grid with its rim, row by row; padded to a power of two, which makes bounds checks unnecessary.
struct Histogram([Cell; 64]);

impl Histogram {
    #[inline(always)]
    fn new() -> Self {
        Self([[0.0; NUM_DIRECTIONS]; 64])
    }

    #[inline(always)]
    fn add(&mut self, samples: &Samples, n: usize) {
        let (rows, columns) = (&samples.row[..n], &samples.column[..n]);
        let (directions, weights) = (&samples.direction[..n], &samples.weight[..n]);
        for i in 0..n {
            // A triangular weight of half-width one around the sample's direction, cyclic.
            let mut tent = [0.0f32; NUM_DIRECTIONS];
            for (k, tent) in tent.iter_mut().enumerate() {
                let apart = (k as f32 - directions[i]).abs();
                let around = NUM_DIRECTIONS as f32 - apart;
                let nearest = if around < apart { around } else { apart };
                let height = 1.0 - nearest;
                *tent = if height > 0.0 { height } else { 0.0 };
            }
            let (row, column) = (rows[i] as i32, columns[i] as i32);
            let (down, right) = (rows[i] - row as f32, columns[i] - column as f32);
            let corner = (row * RIMMED as i32 + column) as usize;
            let (upper, lower) = (weights[i] * (1.0 - down), weights[i] * down);
            let corners = [(0, upper * (1.0 - right)), (1, upper * right)];
            let below = [(RIMMED, lower * (1.0 - right)), (RIMMED + 1, lower * right)];
            for (offset, share) in corners.into_iter().chain(below) {
                let cell = &mut self.0[(corner + offset) % 64];
                for (sum, tent) in cell.iter_mut().zip(&tent) {
                    *sum += share * tent;
                }
            }
        }
    }

    /// The cells inside the rim.
    fn grid(&self) -> [f32; DESCRIPTOR_LENGTH] {
        std::array::from_fn(|i| {
            let (cell, direction) = (i / NUM_DIRECTIONS, i % NUM_DIRECTIONS);
            self.0[(cell / GRID + 1) * RIMMED + cell % GRID + 1][direction]
        })
    }
}

fn normalized(
    histogram: &[f32; DESCRIPTOR_LENGTH],
    normalization: DescriptorNormalization,
) -> Option<[f32; DESCRIPTOR_LENGTH]> {
    let length = |values: &[f32]| values.iter().map(|&v| f64::from(v).powi(2)).sum::<f64>().sqrt();
    let scale = |values: [f32; DESCRIPTOR_LENGTH], divisor: f64| values.map(|v| (f64::from(v) / divisor) as f32);
    let sum = length(histogram);
    if sum <= f64::from(f32::MIN_POSITIVE) {
        return None;
    }
    let clipped = scale(*histogram, sum).map(|v| v.min(CLIP));
    Some(match normalization {
        DescriptorNormalization::Clipped => scale(clipped, length(&clipped)),
        DescriptorNormalization::Root => {
            let sum: f64 = clipped.iter().map(|&v| f64::from(v)).sum();
            scale(clipped, sum).map(f32::sqrt)
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn one_sample(row: f32, column: f32, direction: f32, weight: f32) -> Samples {
        Samples { row: vec![row], column: vec![column], direction: vec![direction], weight: vec![weight] }
    }

    #[test]
    fn a_sample_is_shared_among_eight() {
        let mut histogram = Histogram::new();
        // The sample is a quarter of a cell past row 2, half past column 3, and three quarters past direction 7;
        // direction 8 is 0.
        histogram.add(&one_sample(2.25, 3.5, 7.75, 16.0), 1);
        let at = |row: usize, column: usize| histogram.0[row * RIMMED + column];
        assert_eq!((at(2, 3)[7], at(2, 3)[0]), (1.5, 4.5));
        assert_eq!((at(3, 4)[7], at(3, 4)[0]), (0.5, 1.5));
        assert_eq!(histogram.0.iter().flatten().sum::<f32>(), 16.0);
    }

    #[test]
    fn the_rim_is_cut_off() {
        let mut histogram = Histogram::new();
        histogram.add(&one_sample(0.5, 1.0, 0.0, 2.0), 1);
        let grid = histogram.grid();
        assert_eq!(grid[0], 1.0);
        assert_eq!(grid.iter().sum::<f32>(), 1.0);
    }

    #[test]
    fn both_normalisations_have_unit_length() {
        let histogram = std::array::from_fn(|i| if i == 5 { 100.0 } else { (i % 3) as f32 });
        for normalization in [DescriptorNormalization::Clipped, DescriptorNormalization::Root] {
            let descriptor = normalized(&histogram, normalization).unwrap();
            let length: f32 = descriptor.iter().map(|v| v * v).sum();
            assert!((length - 1.0).abs() < 1e-5);
            // 100 in a vector of length about 101 is clipped to 0.2, so it no longer exceeds the rest by a factor of
            // fifty.
            let ratio = descriptor[5] / descriptor[2];
            assert!(ratio < 15.0, "{ratio}");
        }
        assert_eq!(normalized(&[0.0; DESCRIPTOR_LENGTH], DescriptorNormalization::Root), None);
    }

    #[test]
    fn spans_solve_the_inequality() {
        assert_eq!(span(2.0, 1.0, 3.0), (-2.0, 1.0));
        assert_eq!(span(-2.0, 1.0, 3.0), (-1.0, 2.0));
        assert!(span(0.0, 4.0, 3.0).0 > span(0.0, 4.0, 3.0).1);
        assert!(span(0.0, 2.0, 3.0).0 < -1e6);
    }
}
