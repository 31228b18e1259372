//! Bilinear interpolation in a grid with four values per cell.

use crate::tiles::floor;

/// The values of `cells`, with `width` cells per row, at `(x, y)`, in cells from the first cell's centre. Beyond the
/// outermost centres, the outermost values are used.
///
/// Separate from the interpolation of `sdg-shape`: this one has four floats per cell, which compilers vectorise, and
/// is defined everywhere.
#[inline(always)]
pub(super) fn bilinear(cells: &[[f32; 4]], [width, height]: [usize; 2], x: f32, y: f32) -> [f32; 4] {
    let x = x.max(0.01).min(width as f32 - 1.01);
    let y = y.max(0.01).min(height as f32 - 1.01);
    let (column, row) = (floor(x), floor(y));
    let (fx, fy) = (x - column as f32, y - row as f32);
    let idx = row as usize * width + column as usize;
    let (upper, lower) = (&cells[idx..idx + 2], &cells[idx + width..][..2]);
    let mut sum = [0.0; 4];
    for k in 0..4 {
        let a = upper[0][k] + (upper[1][k] - upper[0][k]) * fx;
        let b = lower[0][k] + (lower[1][k] - lower[0][k]) * fx;
        sum[k] = a + (b - a) * fy;
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn between_centres_beyond_them_and_on_a_border() {
        let cells = [[0.0, 1.0, 2.0, 3.0], [4.0; 4], [8.0; 4], [12.0; 4]];
        let near = |found: [f32; 4], expected: [f32; 4]| {
            assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 0.15), "{found:?}, {expected:?}");
        };
        near(bilinear(&cells, [2, 2], 0.5, 0.5), [6.0, 6.25, 6.5, 6.75]);
        near(bilinear(&cells, [2, 2], -3.0, 0.0), cells[0]);
        near(bilinear(&cells, [2, 2], 9.0, 9.0), cells[3]);
    }
}
