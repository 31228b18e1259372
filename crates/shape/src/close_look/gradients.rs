//! Signed gradients of photo and picture in one frame, compared window by window.
//!
//! ```text
//! frame ─ brightness, smoothed ─ gradient g ─ v = g / (|g| + noise) ─┬─ inside the part: v, with its sign
//!                                                                    └─ along the outline: v at twice its angle, since the table changes
//! photo's field ─ shifted by up to 2 px ─ correlation with the picture's in windows of 9 px ─ best shift of each window
//! ```
//! A window may be shifted to follow a small parallax or distortion. It cannot follow a missing edge, or an edge whose
//! bright and dark sides are exchanged.

use std::ops::Range;

use pulp::{Simd, WithSimd};

use crate::lanes::{in_lanes, larger};

/// Distance between windows, in pixels; a window is three times as wide.
pub(super) const CELL: usize = 3;
/// Pixels within this distance of the outline belong to its edge; pixels further inside belong to the part's surface.
const RIM_PX: f32 = 2.5;
/// Square of the largest shift of a window, in pixels: two along one axis and one along the other.
const MAX_SHIFT_SQUARED: isize = 5;
const REACH: usize = 2;
/// Minimum of the noise level, in grey levels per pixel: gradients below the noise level have little weight.
const NOISE: f32 = 1.5;
/// This share of the gradients' root mean square is the noise level, unless [`NOISE`] is larger.
const NOISE_SHARE: f32 = 0.4;
/// Mean squared length of `v` that is added to every window, so that two empty windows do not correlate.
const EMPTY: f32 = 0.01;
/// Weights of a Gaussian with a standard deviation of 1.2 pixels.
const SMOOTHING: [f32; 7] = [0.0148, 0.0833, 0.2351, 0.3336, 0.2351, 0.0833, 0.0148];

/// The gradients of one picture in the frame, row by row.
#[derive(Debug, Clone)]
pub(super) struct Gradients {
    side: usize,
    /// x and y of `v`.
    signed: [Vec<f32>; 2],
    /// x and y of `v` at twice its angle.
    doubled: [Vec<f32>; 2],
    /// Squared lengths of `v`; doubling the angle does not change them.
    energy: Vec<f32>,
}

impl Gradients {
    /// The gradients of sampled colours; the noise is measured where `counts` holds.
    pub(super) fn new(colors: &[Option<[f32; 3]>], side: usize, counts: impl Fn(usize) -> bool) -> Self {
        let brightness = smoothed(&filled(colors, side), side);
        let [mut signed, mut doubled] = [0, 1].map(|_| [0, 1].map(|_| vec![0.0f32; side * side]));
        let (mut squares, mut count) = (0.0, 0);
        for y in 1..side - 1 {
            for x in 1..side - 1 {
                let at = |dx: usize, dy: usize| brightness[(y + dy - 1) * side + x + dx - 1];
                // Scharr's kernels, in grey levels per pixel.
                let across = 3.0 * (at(2, 0) - at(0, 0) + at(2, 2) - at(0, 2)) + 10.0 * (at(2, 1) - at(0, 1));
                let down = 3.0 * (at(0, 2) - at(0, 0) + at(2, 2) - at(2, 0)) + 10.0 * (at(1, 2) - at(1, 0));
                let gradient = [across / 32.0, down / 32.0];
                (signed[0][y * side + x], signed[1][y * side + x]) = (gradient[0], gradient[1]);
                if counts(y * side + x) {
                    squares += gradient[0] * gradient[0] + gradient[1] * gradient[1];
                    count += 1;
                }
            }
        }
        let noise = NOISE.max(NOISE_SHARE * (squares / (count as f32).max(1.0)).sqrt());
        let mut energy = vec![0.0; side * side];
        for i in 0..side * side {
            let gradient = [signed[0][i], signed[1][i]];
            let length = (gradient[0] * gradient[0] + gradient[1] * gradient[1]).sqrt();
            let [x, y] = gradient.map(|value| value / (length + noise));
            (signed[0][i], signed[1][i]) = (x, y);
            energy[i] = x * x + y * y;
            let length = energy[i].sqrt() + 1e-6;
            (doubled[0][i], doubled[1][i]) = ((x * x - y * y) / length, 2.0 * x * y / length);
        }
        Self { side, signed, doubled, energy }
    }

    /// These gradients, set to zero where `counts` does not hold.
    pub(super) fn only(mut self, counts: impl Fn(usize) -> bool) -> Self {
        for i in (0..self.energy.len()).filter(|i| !counts(*i)) {
            self.signed.iter_mut().chain(&mut self.doubled).for_each(|values| values[i] = 0.0);
            self.energy[i] = 0.0;
        }
        self
    }

    /// Mean squared lengths in windows, over the pixels where `counts` holds.
    pub(super) fn energy_in_windows(&self, counts: impl Fn(usize) -> bool) -> Vec<f32> {
        let mut cells = vec![0.0; num_cells(self.side)];
        for i in (0..self.energy.len()).filter(|i| counts(*i)) {
            cells[cell_of(i, self.side)] += self.energy[i];
        }
        window_means(&cells, self.side)
    }
}

/// The gradients expected from a photo, row by row.
#[derive(Debug, Clone)]
pub(super) struct Expected {
    side: usize,
    /// x and y of the surface's gradients; 0 elsewhere.
    surface: [Vec<f32>; 2],
    /// x and y of the gradients at the outline's edge, at twice their angle; 0 elsewhere.
    rim: [Vec<f32>; 2],
    /// 1 at pixels of the surface and of the rim that stay inside the frame at every shift, else 0.
    counts: Vec<f32>,
    /// Rows that contain such pixels.
    rows: Range<usize>,
    /// Mean squared length in each window.
    pub(super) energy: Vec<f32>,
}

impl Expected {
    /// `depth` is how far each pixel lies inside the outline.
    pub(super) fn new(gradients: &Gradients, depth: &[f32]) -> Self {
        let side = gradients.side;
        let [mut surface, mut rim] = [0, 1].map(|_| [0, 1].map(|_| vec![0.0f32; side * side]));
        let (mut counts, mut cells) = (vec![0.0; side * side], vec![0.0; num_cells(side)]);
        let (mut first, mut last) = (side, 0);
        for (i, depth) in depth.iter().enumerate().filter(|(_, depth)| **depth >= -RIM_PX) {
            cells[cell_of(i, side)] += gradients.energy[i];
            let [x, y] = [i % side, i / side];
            if x.min(y) >= REACH && x.max(y) < side - REACH {
                let is_surface = *depth > RIM_PX;
                let (to, from) =
                    if is_surface { (&mut surface, &gradients.signed) } else { (&mut rim, &gradients.doubled) };
                to.iter_mut().zip(from).for_each(|(to, from)| to[i] = from[i]);
                counts[i] = 1.0;
                (first, last) = (first.min(y), last.max(y));
            }
        }
        Self { side, surface, rim, counts, rows: first..last + 1, energy: window_means(&cells, side) }
    }

    /// The best correlation of each window with a picture, from −1 to 1.
    pub(super) fn fit(&self, picture: &Gradients) -> Vec<f32> {
        let mut best = vec![-1.0f32; num_cells(self.side)];
        let (mut products, mut seen) = (vec![0.0f32; best.len()], vec![0.0f32; best.len()]);
        let reach = REACH as isize;
        for (dx, dy) in (-reach..=reach).flat_map(|dy| (-reach..=reach).map(move |dx| (dx, dy))) {
            if dx * dx + dy * dy > MAX_SHIFT_SQUARED {
                continue;
            }
            let offset = dy * self.side as isize + dx;
            let sums = ShiftedSums { expected: self, picture, offset, products: &mut products, seen: &mut seen };
            in_lanes(sums);
            let (products, seen) = (window_means(&products, self.side), window_means(&seen, self.side));
            for (cell, best) in best.iter_mut().enumerate() {
                let of_both = ((self.energy[cell] + EMPTY) * (seen[cell] + EMPTY)).sqrt();
                *best = larger(products[cell] / of_both, *best);
            }
        }
        best
    }
}

/// Sums over cells of the products of the expected gradients with a picture shifted by `offset` pixels, and of the
/// picture's squared lengths.
struct ShiftedSums<'a> {
    expected: &'a Expected,
    picture: &'a Gradients,
    offset: isize,
    products: &'a mut [f32],
    seen: &'a mut [f32],
}

impl WithSimd for ShiftedSums<'_> {
    type Output = ();

    /// Plain loops over rows; compiled for the widest instructions that the machine has.
    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { expected: Expected { side, surface, rim, counts, rows, .. }, picture, offset, products, seen } =
            self;
        let (side, across) = (*side, side / CELL);
        let len = side - 2 * REACH;
        products.fill(0.0);
        seen.fill(0.0);
        let mut row_products = vec![0.0f32; side];
        let mut row_seen = vec![0.0f32; side];
        for cell_row in rows.start / CELL..rows.end.div_ceil(CELL) {
            row_products.fill(0.0);
            row_seen.fill(0.0);
            for row in (cell_row * CELL).max(rows.start)..((cell_row + 1) * CELL).min(rows.end) {
                let from = row * side + REACH;
                let [surface_x, surface_y] = [0, 1].map(|k| &surface[k][from..][..len]);
                let [rim_x, rim_y] = [0, 1].map(|k| &rim[k][from..][..len]);
                let counts = &counts[from..][..len];
                let there = (from as isize + offset) as usize;
                let [signed_x, signed_y] = [0, 1].map(|k| &picture.signed[k][there..][..len]);
                let [doubled_x, doubled_y] = [0, 1].map(|k| &picture.doubled[k][there..][..len]);
                let energy = &picture.energy[there..][..len];
                let products = &mut row_products[REACH..][..len];
                let seen = &mut row_seen[REACH..][..len];
                for k in 0..len {
                    products[k] += surface_x[k] * signed_x[k]
                        + surface_y[k] * signed_y[k]
                        + rim_x[k] * doubled_x[k]
                        + rim_y[k] * doubled_y[k];
                    seen[k] += counts[k] * energy[k];
                }
            }
            for column in 0..across {
                products[cell_row * across + column] = row_products[CELL * column..][..CELL].iter().sum();
                seen[cell_row * across + column] = row_seen[CELL * column..][..CELL].iter().sum();
            }
        }
    }
}

/// Number of cells of a square frame.
pub(super) fn num_cells(side: usize) -> usize {
    (side / CELL) * (side / CELL)
}

/// The cell that a pixel lies in.
pub(super) fn cell_of(pixel: usize, side: usize) -> usize {
    (pixel / side / CELL) * (side / CELL) + pixel % side / CELL
}

/// Means over a cell and its eight neighbours, from sums over cells; cells beyond the frame are empty.
fn window_means(cells: &[f32], side: usize) -> Vec<f32> {
    let across = side / CELL;
    let mut row_sums = vec![0.0; cells.len() + 2 * across];
    let mut padded = vec![0.0; across + 2];
    for (row, sums) in cells.chunks_exact(across).zip(row_sums[across..].chunks_exact_mut(across)) {
        padded[1..=across].copy_from_slice(row);
        for (x, sum) in sums.iter_mut().enumerate() {
            *sum = padded[x] + padded[x + 1] + padded[x + 2];
        }
    }
    let pixels = (9 * CELL * CELL) as f32;
    let (above, here, below) = (&row_sums, &row_sums[across..], &row_sums[2 * across..]);
    (0..cells.len()).map(|i| (above[i] + here[i] + below[i]) / pixels).collect()
}

/// Brightness from 0 to 255. A pixel outside the picture gets the brightness of the next pixel inside the picture to
/// its left, else to its right, else above, else below.
fn filled(colors: &[Option<[f32; 3]>], side: usize) -> Vec<f32> {
    let mut brightness: Vec<Option<f32>> =
        colors.iter().map(|color| color.map(|color| 85.0 * color.iter().sum::<f32>())).collect();
    for row in brightness.chunks_exact_mut(side) {
        for forward in [true, false] {
            let mut last = None;
            for k in 0..side {
                let value = &mut row[if forward { k } else { side - 1 - k }];
                *value = value.or(last);
                last = *value;
            }
        }
    }
    for k in side..brightness.len() {
        brightness[k] = brightness[k].or(brightness[k - side]);
    }
    for k in (0..brightness.len() - side).rev() {
        brightness[k] = brightness[k].or(brightness[k + side]);
    }
    brightness.into_iter().map(Option::unwrap_or_default).collect()
}

/// Smoothed along rows, then along columns; beyond the border the border's pixels are repeated.
fn smoothed(values: &[f32], side: usize) -> Vec<f32> {
    in_lanes(Smooth { values, side })
}

struct Smooth<'a> {
    values: &'a [f32],
    side: usize,
}

impl WithSimd for Smooth<'_> {
    type Output = Vec<f32>;

    /// Plain loops over rows; compiled for the widest instructions that the machine has.
    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Vec<f32> {
        const HALF: usize = SMOOTHING.len() / 2;
        let Self { values, side } = self;
        let mut across = vec![0.0f32; values.len()];
        let mut padded = vec![0.0f32; side + 2 * HALF];
        for (row, out) in values.chunks_exact(side).zip(across.chunks_exact_mut(side)) {
            padded[HALF..][..side].copy_from_slice(row);
            padded[..HALF].fill(row[0]);
            padded[HALF + side..].fill(row[side - 1]);
            for (k, weight) in SMOOTHING.iter().enumerate() {
                for (out, value) in out.iter_mut().zip(&padded[k..][..side]) {
                    *out += weight * value;
                }
            }
        }
        let mut smoothed = vec![0.0f32; values.len()];
        for (y, out) in smoothed.chunks_exact_mut(side).enumerate() {
            for (k, weight) in SMOOTHING.iter().enumerate() {
                let row = (y + k).saturating_sub(HALF).min(side - 1);
                for (out, value) in out.iter_mut().zip(&across[row * side..][..side]) {
                    *out += weight * value;
                }
            }
        }
        smoothed
    }
}
