//! Gaussian blur, and resizing by a factor of two: the operations of a scale space.
//!
//! Rows are processed in bands, so that the cores divide the work and a band's rows stay in the cache. A row is
//! blurred down its columns into a padded buffer, and from there along the row, by the same symmetric fold. Products
//! and sums are never fused, so every machine gives the same bits.

use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

use crate::Plane;

/// Number of rows that a core processes at a time.
const BAND: usize = 24;

/// The right half of a sampled Gaussian, centre first; the sum of the whole Gaussian is one.
#[derive(Debug, Clone)]
pub(crate) struct GaussianKernel {
    half: Vec<f32>,
}

impl GaussianKernel {
    /// Truncated at four σ, where the Gaussian has 3e-4 of its height.
    pub(crate) fn new(sigma: f64) -> Self {
        let radius = (4.0 * sigma).round() as usize;
        let weight = |i: usize| if i == 0 { 1.0 } else { (-0.5 * (i as f64 / sigma).powi(2)).exp() };
        let sum = 1.0 + 2.0 * (1..=radius).map(weight).sum::<f64>();
        Self { half: (0..=radius).map(|i| (weight(i) / sum) as f32).collect() }
    }
}

/// Blurs `source` into `target`, which has the same size; beyond the border the image is mirrored about its outermost
/// pixels.
pub(crate) fn blur(source: &Plane, target: &mut Plane, kernel: &GaussianKernel) {
    assert_eq!(
        (source.width(), source.height()),
        (target.width(), target.height()),
        "expected planes of the same size"
    );
    let width = source.width();
    if width == 0 {
        return;
    }
    let arch = Arch::new();
    target.data_mut().par_chunks_mut(BAND * width).enumerate().for_each(|(band, rows)| {
        arch.dispatch(BlurRows { source, rows, first: band * BAND, half: &kernel.half });
    });
}

/// Enlarges the image to twice its size, by linear interpolation between pixel centres.
///
/// The centre of pixel `j` of the result is at (j + 0.5) / 2 in the image.
pub(crate) fn double(source: &Plane, target: &mut Plane) {
    let (width, height) = (source.width(), source.height());
    assert_eq!((2 * width, 2 * height), (target.width(), target.height()), "expected a target of twice the size");
    if width == 0 || height == 0 {
        return;
    }
    target.data_mut().par_chunks_mut(2 * width).enumerate().for_each(|(y, row)| {
        // The nearer source row has the weight 3/4, the row on the other side 1/4.
        let near = source.row(y / 2);
        let far = source.row(if y % 2 == 0 { (y / 2).saturating_sub(1) } else { (y / 2 + 1).min(height - 1) });
        let mixed = |x: usize| 0.75 * near[x] + 0.25 * far[x];
        let (mut left, mut center) = (mixed(0), mixed(0));
        for (x, pair) in row.chunks_exact_mut(2).enumerate() {
            let right = mixed((x + 1).min(width - 1));
            pair[0] = 0.75 * center + 0.25 * left;
            pair[1] = 0.75 * center + 0.25 * right;
            (left, center) = (center, right);
        }
    });
}

/// Keeps every second pixel of every second row, beginning with the first; `target` has half the size, rounded up.
pub(crate) fn halve(source: &Plane, target: &mut Plane) {
    let width = target.width();
    assert_eq!(
        (source.width().div_ceil(2), source.height().div_ceil(2)),
        (width, target.height()),
        "expected a target of half the size"
    );
    for y in 0..target.height() {
        let from = source.row(2 * y).iter().step_by(2);
        for (to, &from) in target.data_mut()[y * width..(y + 1) * width].iter_mut().zip(from) {
            *to = from;
        }
    }
}

/// Some rows of the blurred image, beginning with row `first`.
struct BlurRows<'a> {
    source: &'a Plane,
    rows: &'a mut [f32],
    first: usize,
    half: &'a [f32],
}

impl WithSimd for BlurRows<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let (width, height) = (self.source.width(), self.source.height());
        let radius = self.half.len() - 1;
        let mut padded = vec![0.0; width + 2 * radius];
        let mut pairs: Vec<(&[f32], &[f32])> = Vec::with_capacity(radius);
        for (i, row) in self.rows.chunks_exact_mut(width).enumerate() {
            let y = (self.first + i) as isize;
            pairs.clear();
            let source_row = |y: isize| self.source.row(mirrored(y, height));
            pairs.extend((1..=radius as isize).map(|d| (source_row(y - d), source_row(y + d))));
            fold(&mut padded[radius..radius + width], self.source.row(y as usize), self.half, |d| pairs[d - 1]);
            for d in 1..=radius {
                padded[radius - d] = padded[radius + mirrored(-(d as isize), width)];
                padded[radius + width - 1 + d] = padded[radius + mirrored((width - 1 + d) as isize, width)];
            }
            let shifted = |by: usize| &padded[by..by + width];
            fold(row, shifted(radius), self.half, |d| (shifted(radius - d), shifted(radius + d)));
        }
    }
}

/// out = half[0] · center + Σ half[d] · (the two neighbours at distance d), element by element.
#[inline(always)]
fn fold<'a>(out: &mut [f32], center: &[f32], half: &[f32], neighbours: impl Fn(usize) -> (&'a [f32], &'a [f32])) {
    let done = fold_blocks::<64>(out, center, half, &neighbours, 0);
    let done = fold_blocks::<16>(out, center, half, &neighbours, done);
    fold_blocks::<1>(out, center, half, &neighbours, done);
}

/// Computes `N` elements at a time, so that their sums stay in registers over all taps. Returns the index of the next
/// element.
#[inline(always)]
fn fold_blocks<'a, const N: usize>(
    out: &mut [f32],
    center: &[f32],
    half: &[f32],
    neighbours: &impl Fn(usize) -> (&'a [f32], &'a [f32]),
    start: usize,
) -> usize {
    let mut x = start;
    while x + N <= out.len() {
        let mut sum = [0.0f32; N];
        for (sum, &value) in sum.iter_mut().zip(&center[x..x + N]) {
            *sum = half[0] * value;
        }
        for (d, &weight) in half.iter().enumerate().skip(1) {
            let (before, after) = neighbours(d);
            let pairs = before[x..x + N].iter().zip(&after[x..x + N]);
            for (sum, (&before, &after)) in sum.iter_mut().zip(pairs) {
                *sum += weight * (before + after);
            }
        }
        out[x..x + N].copy_from_slice(&sum);
        x += N;
    }
    x
}

/// `i` mirrored into `0..n` about the outermost pixels' centres, repeatedly if necessary.
fn mirrored(i: isize, n: usize) -> usize {
    if n == 1 {
        return 0;
    }
    let period = 2 * (n as isize - 1);
    let i = i.rem_euclid(period);
    i.min(period - i) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rounding error of about fifty sums of values up to one.
    const ROUNDING: f32 = 1e-5;

    fn wavy(width: u32, height: u32) -> Plane {
        Plane::from_fn(width, height, |x, y| 0.5 + 0.3 * (0.7 * x as f32).sin() + 0.2 * (0.4 * (x * y) as f32).cos())
    }

    fn blurred(source: &Plane, sigma: f64) -> Plane {
        let mut target = source.clone();
        blur(source, &mut target, &GaussianKernel::new(sigma));
        target
    }

    #[test]
    fn mirrors_about_the_outermost_pixels() {
        let at = |i| mirrored(i, 4);
        assert_eq!([-7, -3, -1, 0, 3, 4, 5, 6, 7].map(at), [1, 3, 1, 0, 3, 2, 1, 0, 1]);
        assert_eq!(mirrored(-5, 1), 0);
    }

    #[test]
    fn agrees_with_the_sum_written_out() {
        for (width, height) in [(90, 31), (17, 3), (1, 5), (2, 2)] {
            let source = wavy(width, height);
            let kernel = GaussianKernel::new(1.9);
            let fast = blurred(&source, 1.9);
            let radius = kernel.half.len() as isize - 1;
            for y in 0..height as isize {
                for x in 0..width as isize {
                    let mut sum = 0.0;
                    for dy in -radius..=radius {
                        for dx in -radius..=radius {
                            let weight = kernel.half[dx.unsigned_abs()] * kernel.half[dy.unsigned_abs()];
                            sum +=
                                weight * source.at(mirrored(x + dx, width as usize), mirrored(y + dy, height as usize));
                        }
                    }
                    assert!((fast.at(x as usize, y as usize) - sum).abs() < ROUNDING, "({x}, {y})");
                }
            }
        }
    }

    #[test]
    fn two_blurs_are_one_of_the_root_sum_square() {
        let source = wavy(80, 60);
        let (twice, once) = (blurred(&blurred(&source, 1.5), 2.0), blurred(&source, 2.5));
        let worst = twice.data().iter().zip(once.data()).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        // The kernels are truncated at four sigma and sampled: an error of a few parts in ten thousand remains.
        assert!(worst < 1e-3, "{worst}");
    }

    #[test]
    fn doubling_keeps_a_ramp_and_its_place() {
        let ramp = Plane::from_fn(8, 4, |x, _| x as f32 + 0.5);
        let mut doubled = Plane::recycled(16, 8, Vec::new());
        double(&ramp, &mut doubled);
        // Away from the border, the value at a pixel is its centre's position in the image.
        for j in 1..15 {
            assert!((doubled.at(j, 3) - (j as f32 + 0.5) / 2.0).abs() < ROUNDING);
        }
        let mut halved = Plane::recycled(4, 2, Vec::new());
        halve(&ramp, &mut halved);
        assert_eq!(halved.row(1), [0.5, 2.5, 4.5, 6.5]);
    }
}
