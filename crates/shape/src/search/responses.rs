//! Look-up tables of one image: the agreement of each of a few quantised directions with each place.
//!
//! Legend: `k` one of [`NUM_DIRECTIONS`] directions, evenly spaced over 180°, since gradients have no sign; the
//! response of direction `k` at pixel `(x, y)` of the pyramid level is the best of
//! `cos 2(direction k − gradient direction)` over the pixels at most [`SPREAD`] away, from 0 to [`FULL`]. An edge point
//! of the template whose normal is nearest to direction `k` reads its share of the agreement with one table access.
//!
//! The part's centre is tried at places that are [`PITCH`] pixels apart. Pixels are therefore kept in one table for
//! each remainder of x and y, so that neighbouring places read neighbouring bytes.
//!
//! Spreading allows a step between places and angles that is wider than an edge. Since the best response counts and
//! directions are not averaged, both edges of a thin part keep their responses.
//!
//! # Source
//! The idea of spread directions, response maps and their order in memory is LINE-2D's (Hinterstoisser et al.,
//! *Gradient Response Maps for Real-Time Detection of Textureless Objects*, 2012). Here the tables are computed from
//! the directions themselves instead of bit masks, so that an edge's strength and sharpness count.

use std::f32::consts::TAU;

use pulp::{Simd, WithSimd};

use crate::gradient_field::{GradientLevel, whole};
use crate::lanes::{in_lanes, larger};
use crate::parallel;

/// Directions over 180°; neighbours are 11.25° apart, which costs at most 2 % of the cosine. Derived from that loss and
/// from the number of tables, which must fit in a byte.
pub(crate) const NUM_DIRECTIONS: usize = 16;
/// Response of an edge of exactly the table's direction. Small, so that 17 of them add up within a byte. Derived: 255
/// is 17 times 15.
pub(crate) const FULL: u8 = 15;

/// The direction nearest to `(cos 2φ, sin 2φ)`.
pub(crate) fn direction_idx(double: [f32; 2]) -> usize {
    let step = TAU / NUM_DIRECTIONS as f32;
    (double[1].atan2(double[0]) / step).round().rem_euclid(NUM_DIRECTIONS as f32) as usize % NUM_DIRECTIONS
}

/// Level pixels from one place to the next. Chosen together with [`SPREAD`]: the responses of neighbouring places
/// overlap. Not measured.
pub(crate) const PITCH: usize = 2;
/// How far responses are spread, in level pixels in every direction. Chosen by hand, not measured.
pub(crate) const SPREAD: usize = 2;

/// Places that are summed together; a table ends with as many zeros, so that the last block may be read whole. Chosen
/// to save time; it does not change results.
pub(crate) const BLOCK: usize = 128;

/// The table of direction `k` with the pixels whose x and y have these remainders modulo [`PITCH`].
pub(crate) fn table_idx(k: usize, x: usize, y: usize) -> usize {
    (k * PITCH + y % PITCH) * PITCH + x % PITCH
}

/// The tables of one pyramid level, padded with zeros so that templates may extend beyond the border.
///
/// # Shapes
/// A table is flat; the pixels of place `(x, y)` are at [`Responses::idx_of`]. Adjacent rows share the padding between
/// them.
pub(crate) struct Responses {
    /// Places per row.
    pub(crate) width: usize,
    /// Rows of places.
    pub(crate) height: usize,
    pad: usize,
    tables: Vec<Vec<u8>>,
}

impl Responses {
    /// Fills the tables; templates may extend `pad` places beyond the image.
    pub(crate) fn new(level: &GradientLevel, pad: usize) -> Self {
        let pad = pad + 1;
        let mut made = Self {
            width: level.width().div_ceil(PITCH),
            height: level.height().div_ceil(PITCH),
            pad,
            tables: Vec::new(),
        };
        let directions: Vec<usize> = (0..NUM_DIRECTIONS).collect();
        let planes = DirectionPlanes::of(level);
        let tables = parallel::map(&directions, |&k| {
            let (sin, cos) = (k as f32 * TAU / NUM_DIRECTIONS as f32).sin_cos();
            let mut tables = made.empty_tables();
            planes.spread([cos, sin], |row, responses| made.split(row, responses, &mut tables));
            tables
        });
        made.tables = tables.into_iter().flatten().collect();
        made
    }

    /// Places from one row of a table to the next.
    pub(crate) fn stride(&self) -> usize {
        self.width + self.pad
    }

    /// The index of place `(x, y)` in a table.
    pub(crate) fn idx_of(&self, x: usize, y: usize) -> usize {
        (y + self.pad) * self.stride() + self.pad + x
    }

    /// One table; see [`table_idx`].
    pub(crate) fn table(&self, idx: usize) -> &[u8] {
        &self.tables[idx]
    }

    /// The tables of one direction, in the order of [`table_idx`].
    fn empty_tables(&self) -> Vec<Vec<u8>> {
        let len = (self.height + 2 * self.pad) * self.stride() + self.pad + BLOCK;
        vec![vec![0u8; len]; PITCH * PITCH]
    }

    /// Writes a row of one direction's responses into its tables.
    fn split(&self, row: usize, responses: &[u8], tables: &mut [Vec<u8>]) {
        let at = self.idx_of(0, row / PITCH);
        for right in 0..PITCH {
            let out = &mut tables[table_idx(0, right, row)][at..at + self.width];
            let (pairs, last) = responses.as_chunks::<PITCH>();
            for (out, pair) in out.iter_mut().zip(pairs) {
                *out = pair[right];
            }
            if let (Some(out), Some(&value)) = (out.get_mut(pairs.len()), last.get(right)) {
                *out = value;
            }
        }
    }
}

/// The directions of a level, one array per coordinate, because they are read once for each direction of a table.
struct DirectionPlanes {
    width: usize,
    height: usize,
    x: Vec<f32>,
    y: Vec<f32>,
}

impl DirectionPlanes {
    fn of(level: &GradientLevel) -> Self {
        let (width, height) = (level.width(), level.height());
        let (mut x, mut y) = (Vec::with_capacity(width * height), Vec::with_capacity(width * height));
        for row in (0..height).map(|row| level.row(row)) {
            x.extend(row.iter().map(|sample| sample[0]));
            y.extend(row.iter().map(|sample| sample[1]));
        }
        Self { width, height, x, y }
    }

    /// The responses of one direction at every pixel: `put` is called with each row from the first to the last.
    fn spread(&self, direction: [f32; 2], mut put: impl FnMut(usize, &[u8])) {
        const RING: usize = 2 * SPREAD + 1;
        let (width, height) = (self.width, self.height);
        // Each row spread to the left and right; the last few rows are kept.
        let mut across = [(); RING].map(|()| vec![0u8; width]);
        let mut plain = vec![0u8; width + 2 * SPREAD];
        let mut spread = vec![0u8; width];
        for row in 0..height + SPREAD {
            if row < height {
                let range = row * width..(row + 1) * width;
                let out = &mut plain[SPREAD..SPREAD + width];
                in_lanes(Responded { x: &self.x[range.clone()], y: &self.y[range], direction, out });
                let across = &mut across[row % RING];
                across.copy_from_slice(&plain[..width]);
                for shift in 1..RING {
                    in_lanes(Raise { values: across, to: &plain[shift..shift + width] });
                }
            }
            let Some(middle) = row.checked_sub(SPREAD) else { continue };
            spread.copy_from_slice(&across[middle % RING]);
            for near in middle.saturating_sub(SPREAD)..(middle + SPREAD + 1).min(height) {
                in_lanes(Raise { values: &mut spread, to: &across[near % RING] });
            }
            put(middle, &spread);
        }
    }
}

/// The responses of a row.
struct Responded<'a> {
    x: &'a [f32],
    y: &'a [f32],
    direction: [f32; 2],
    out: &'a mut [u8],
}

impl WithSimd for Responded<'_> {
    type Output = ();

    /// A plain loop; compiled for the widest instructions that the machine has.
    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { x, y, direction, out } = self;
        for ((out, &x), &y) in out.iter_mut().zip(x).zip(y) {
            let cosine = x * direction[0] + y * direction[1];
            *out = whole((larger(cosine, 0.0) * f32::from(FULL) + 0.5).floor()) as u8;
        }
    }
}

/// Raises every value at least to its counterpart.
struct Raise<'a> {
    values: &'a mut [u8],
    to: &'a [u8],
}

impl WithSimd for Raise<'_> {
    type Output = ();

    /// As in [`Responded`].
    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        for (value, &other) in self.values.iter_mut().zip(self.to) {
            *value = (*value).max(other);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::GradientField;
    use image::{Rgb, RgbImage};

    /// The responses of one direction, pixel by pixel.
    fn looked_up(level: &GradientLevel, direction: [f32; 2]) -> Vec<u8> {
        let response = |x: usize, y: usize| {
            let [dx, dy, ..] = level.row(y)[x];
            ((dx * direction[0] + dy * direction[1]).max(0.0) * f32::from(FULL) + 0.5) as u8
        };
        let near = |at: usize, end: usize| at.saturating_sub(SPREAD)..(at + SPREAD + 1).min(end);
        let best = |x: usize, y: usize| {
            let rows = near(y, level.height());
            rows.flat_map(|y| near(x, level.width()).map(move |x| (x, y))).map(|(x, y)| response(x, y)).max()
        };
        (0..level.width() * level.height()).map(|i| best(i % level.width(), i / level.width()).unwrap()).collect()
    }

    #[test]
    fn directions_are_numbered_at_twice_their_angle() {
        assert_eq!(direction_idx([1.0, 0.0]), 0);
        assert_eq!(direction_idx([0.0, 1.0]), NUM_DIRECTIONS / 4);
        assert_eq!(direction_idx([-1.0, -1e-6]), NUM_DIRECTIONS / 2);
        assert_eq!(direction_idx([1.0, -1e-6]), 0);
    }

    #[test]
    fn an_upright_edge_answers_in_its_own_table_beside_itself_and_not_across() {
        let image = RgbImage::from_fn(64, 48, |x, _| Rgb(if x < 32 { [30; 3] } else { [220; 3] }));
        let field = GradientField::new(&image);
        let responses = Responses::new(field.level(0), 5);
        let at = |k: usize, x: usize| responses.table(table_idx(k, x, 21))[responses.idx_of(x / PITCH, 10)];
        // The gradient runs along x: direction 0; y is direction `NUM_DIRECTIONS / 2`.
        assert_eq!(at(0, 32), FULL);
        assert_eq!(at(0, 31), FULL);
        assert_eq!(at(NUM_DIRECTIONS / 2, 32), 0);
        assert_eq!(at(0, 10), 0);
        // Direction 2 is at 22.5°: 15 cos 45° is 10.6.
        assert_eq!(at(2, 32), 11);
    }

    #[test]
    fn every_pixel_stands_in_one_table_and_outside_is_zero() {
        let image = RgbImage::from_fn(51, 49, |x, y| Rgb([(x * x) as u8, (y * 5 + x) as u8, 0]));
        let field = GradientField::new(&image);
        let responses = Responses::new(field.level(0), 3);
        let (k, plain) = (4, looked_up(field.level(0), [0.0, 1.0]));
        for y in 0..49 {
            for x in 0..51 {
                let kept = responses.table(table_idx(k, x, y))[responses.idx_of(x / PITCH, y / PITCH)];
                assert_eq!(kept, plain[y * 51 + x], "{x}, {y}");
            }
        }
        let sum = |values: &[u8]| values.iter().map(|&v| u64::from(v)).sum::<u64>();
        let kept: u64 = (0..PITCH * PITCH).map(|i| sum(responses.table(table_idx(k, i % PITCH, i / PITCH)))).sum();
        assert_eq!(kept, sum(&plain));
    }
}
