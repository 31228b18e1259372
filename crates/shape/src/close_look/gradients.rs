//! Signed gradients of photo and picture in one frame, compared place by place.
//!
//! ```text
//! frame ─ brightness, smoothed ─ gradient g ─ v = g / (|g| + noise) ─┬─ inside the part: v, with its sign
//!                                                                    └─ along the outline: v at twice its angle, since the table changes
//! photo's field ─ shifted by up to 2 px ─ correlation with the picture's in windows of 9 px ─ best shift of each window
//! ```
//! A window may follow a small parallax or distortion; an edge that is not there, or whose bright and dark side are exchanged, it
//! cannot follow.

/// Windows stand so many pixels apart and are three times as wide.
pub(super) const CELL: usize = 3;
/// Pixels within this distance of the outline are its edge; more than that inside, the part's surface.
const RIM_PX: f32 = 2.5;
/// How far a window may be shifted, squared, in pixels: two along a row or column and one across.
const MAX_SHIFT_SQUARED: isize = 5;
const REACH: usize = 2;
/// Gradients below this are noise, in grey levels a pixel, and below the second value as a share of the root mean square.
const NOISE: f32 = 1.5;
const NOISE_SHARE: f32 = 0.4;
/// Mean squared length of `v` that every window is taken to have: between two empty windows nothing correlates.
const EMPTY: f32 = 0.01;
/// Binomial-like weights of a Gaussian of 1.2 pixels.
const SMOOTHING: [f32; 7] = [0.0148, 0.0833, 0.2351, 0.3336, 0.2351, 0.0833, 0.0148];

/// The gradients of one picture in the frame, row by row.
#[derive(Debug, Clone)]
pub(super) struct Gradients {
    side: usize,
    signed: Vec<[f32; 2]>,
    doubled: Vec<[f32; 2]>,
    /// Squared lengths, the same of both.
    energy: Vec<f32>,
}

impl Gradients {
    /// Of sampled colours; the noise is judged where `counts`.
    pub(super) fn new(colors: &[Option<[f32; 3]>], side: usize, counts: impl Fn(usize) -> bool) -> Self {
        let brightness = smoothed(&filled(colors, side), side);
        let mut signed = vec![[0.0; 2]; side * side];
        let (mut squares, mut count) = (0.0, 0);
        for y in 1..side - 1 {
            for x in 1..side - 1 {
                let at = |dx: usize, dy: usize| brightness[(y + dy - 1) * side + x + dx - 1];
                // Scharr's kernels, in grey levels a pixel.
                let across = 3.0 * (at(2, 0) - at(0, 0) + at(2, 2) - at(0, 2)) + 10.0 * (at(2, 1) - at(0, 1));
                let down = 3.0 * (at(0, 2) - at(0, 0) + at(2, 2) - at(2, 0)) + 10.0 * (at(1, 2) - at(1, 0));
                let gradient = [across / 32.0, down / 32.0];
                signed[y * side + x] = gradient;
                if counts(y * side + x) {
                    squares += gradient[0] * gradient[0] + gradient[1] * gradient[1];
                    count += 1;
                }
            }
        }
        let noise = NOISE.max(NOISE_SHARE * (squares / (count as f32).max(1.0)).sqrt());
        let mut made = Self { side, doubled: vec![[0.0; 2]; side * side], energy: vec![0.0; side * side], signed };
        for i in 0..side * side {
            let length = made.signed[i][0].hypot(made.signed[i][1]);
            let [x, y] = made.signed[i].map(|value| value / (length + noise));
            made.signed[i] = [x, y];
            made.energy[i] = x * x + y * y;
            let length = made.energy[i].sqrt() + 1e-6;
            made.doubled[i] = [(x * x - y * y) / length, 2.0 * x * y / length];
        }
        made
    }

    /// The same with nothing where `counts` does not hold.
    pub(super) fn only(mut self, counts: impl Fn(usize) -> bool) -> Self {
        for i in (0..self.energy.len()).filter(|i| !counts(*i)) {
            self.signed[i] = [0.0; 2];
            self.doubled[i] = [0.0; 2];
            self.energy[i] = 0.0;
        }
        self
    }

    /// Squared lengths in windows where `counts`, their means.
    pub(super) fn energy_in_windows(&self, counts: impl Fn(usize) -> bool) -> Vec<f32> {
        let mut cells = vec![0.0; num_cells(self.side)];
        for i in (0..self.energy.len()).filter(|i| counts(*i)) {
            cells[cell_of(i, self.side)] += self.energy[i];
        }
        window_means(&cells, self.side)
    }
}

/// What a photo says should be seen, row by row.
#[derive(Debug, Clone)]
pub(super) struct Expected {
    side: usize,
    pixels: Vec<ExpectedPixel>,
    /// Mean squared length in each window.
    pub(super) energy: Vec<f32>,
}

/// A pixel of the surface or of the outline's edge, no nearer to the frame's border than shifts reach.
#[derive(Debug, Clone)]
struct ExpectedPixel {
    idx: usize,
    cell: usize,
    is_surface: bool,
    direction: [f32; 2],
}

impl Expected {
    /// `depth` is how far each pixel lies inside the outline.
    pub(super) fn new(gradients: &Gradients, depth: &[f32]) -> Self {
        let side = gradients.side;
        let mut pixels = Vec::new();
        let mut cells = vec![0.0; num_cells(side)];
        for (i, depth) in depth.iter().enumerate().filter(|(_, depth)| **depth >= -RIM_PX) {
            let is_surface = *depth > RIM_PX;
            let direction = if is_surface { gradients.signed[i] } else { gradients.doubled[i] };
            cells[cell_of(i, side)] += gradients.energy[i];
            let [x, y] = [i % side, i / side];
            if x.min(y) >= REACH && x.max(y) < side - REACH {
                pixels.push(ExpectedPixel { idx: i, cell: cell_of(i, side), is_surface, direction });
            }
        }
        Self { side, pixels, energy: window_means(&cells, side) }
    }

    /// The best correlation of each window with a picture, from −1 to 1.
    pub(super) fn fit(&self, picture: &Gradients) -> Vec<f32> {
        let side = self.side as isize;
        let mut best = vec![-1.0f32; num_cells(self.side)];
        for (dx, dy) in (-(REACH as isize)..=REACH as isize)
            .flat_map(|dy| (-(REACH as isize)..=REACH as isize).map(move |dx| (dx, dy)))
        {
            if dx * dx + dy * dy > MAX_SHIFT_SQUARED {
                continue;
            }
            let mut products = vec![0.0f32; best.len()];
            let mut seen = vec![0.0f32; best.len()];
            for pixel in &self.pixels {
                let j = (pixel.idx as isize + dy * side + dx) as usize;
                let [u, v] = if pixel.is_surface { picture.signed[j] } else { picture.doubled[j] };
                products[pixel.cell] += pixel.direction[0] * u + pixel.direction[1] * v;
                seen[pixel.cell] += picture.energy[j];
            }
            let (products, seen) = (window_means(&products, self.side), window_means(&seen, self.side));
            for (cell, best) in best.iter_mut().enumerate() {
                let of_both = ((self.energy[cell] + EMPTY) * (seen[cell] + EMPTY)).sqrt();
                *best = best.max(products[cell] / of_both);
            }
        }
        best
    }
}

/// Cells along a side of the frame, squared.
pub(super) fn num_cells(side: usize) -> usize {
    (side / CELL) * (side / CELL)
}

/// The cell that a pixel lies in.
pub(super) fn cell_of(pixel: usize, side: usize) -> usize {
    (pixel / side / CELL) * (side / CELL) + pixel % side / CELL
}

/// Means over a cell and its eight neighbours, of sums in cells; beyond the frame there is nothing.
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

/// Brightness from 0 to 255; where there is no picture, that of the nearest pixel of the row, or of the row above.
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

fn smoothed(values: &[f32], side: usize) -> Vec<f32> {
    let pass = |values: &[f32], step: usize| -> Vec<f32> {
        let half = SMOOTHING.len() / 2;
        let mean = |i: usize| {
            let along = i / step % side;
            let start = i - along * step;
            let of = |(k, weight): (usize, &f32)| {
                weight * values[start + (along + k).saturating_sub(half).min(side - 1) * step]
            };
            SMOOTHING.iter().enumerate().map(of).sum()
        };
        (0..values.len()).map(mean).collect()
    };
    pass(&pass(values, 1), side)
}
