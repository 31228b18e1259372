//! Whether the corners of a grid belong to a board: they lie on a plane, and brightness varies between squares but not
//! within a square.

use std::collections::BTreeMap;

use nalgebra::{Point2, Vector2};
use sdg_geometry::upper_median;

use super::luminance::Luminance;
use super::seen_corner::SeenCorner;
use crate::board::Board;
use crate::homography;

/// Largest root mean square distance of corners from a homography, in sides of a square. Among the boards in this
/// crate's tests, the lenses with the strongest distortion give 0.08; grids in photos of wood, metal and cloth give at
/// least 0.13.
const MAX_OFF: f64 = 0.12;
/// Largest variation of brightness within a square, divided by the difference to its neighbours: medians over all
/// squares. The boards of the tests have at most 0.03 (dark, noisy), grids in photos of wood, metal and cloth at least
/// 0.7.
const MAX_VARIATION: f64 = 0.35;
/// Points at which a square's own colour is sampled, in sides of the square: outside a dot and inside the edges.
const RING: [[f64; 2]; 8] =
    [[0.27, 0.27], [0.73, 0.27], [0.27, 0.73], [0.73, 0.73], [0.18, 0.5], [0.82, 0.5], [0.5, 0.18], [0.5, 0.82]];

/// Whether these are corners of a board.
pub(super) fn is_board(picture: &Luminance, corners: &[SeenCorner]) -> bool {
    off(corners).is_some_and(|off| off <= MAX_OFF)
        && variation(picture, corners).is_some_and(|variation| variation <= MAX_VARIATION)
}

fn place([i, j]: [u32; 2]) -> Point2<f64> {
    Point2::new(f64::from(i), f64::from(j))
}

/// Root mean square distance of the corners from a homography, in sides of a square.
fn off(corners: &[SeenCorner]) -> Option<f64> {
    let places: Vec<_> = corners.iter().map(|seen| (place(seen.corner), seen.pixel)).collect();
    let homography = homography::fit(&places)?;
    let squares = corners.iter().map(|seen| {
        let at = |place: Point2<f64>| homography::apply(&homography, &place);
        let here = place(seen.corner);
        let area = (at(here + Vector2::x()) - at(here)).perp(&(at(here + Vector2::y()) - at(here))).abs();
        (at(here) - seen.pixel).norm_squared() / area
    });
    Some((squares.sum::<f64>() / corners.len() as f64).sqrt())
}

/// Variation of brightness within squares, divided by the difference of brightness between neighbouring squares.
fn variation(picture: &Luminance, corners: &[SeenCorner]) -> Option<f64> {
    let pixels: BTreeMap<[u32; 2], Point2<f64>> = corners.iter().map(|seen| (seen.corner, seen.pixel)).collect();
    let rings = pixels.keys().filter_map(|&[i, j]| {
        let at = |i, j| Some(pixels.get(&[i, j])?.coords);
        let [a, b, c, d] = [at(i, j)?, at(i + 1, j)?, at(i, j + 1)?, at(i + 1, j + 1)?];
        let samples = RING.iter().map(|[u, v]| {
            let within = (a * (1.0 - u) + b * *u) * (1.0 - v) + (c * (1.0 - u) + d * *u) * *v;
            picture.sample(&Point2::from(within))
        });
        let samples: Vec<f64> = samples.collect::<Option<_>>()?;
        let mean = samples.iter().sum::<f64>() / samples.len() as f64;
        let variance = samples.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / samples.len() as f64;
        // The sign makes the difference positive if dark squares are darker than light ones.
        let sign = if Board::is_dark(i, j) { -1.0 } else { 1.0 };
        Some(([i, j], (mean, variance.sqrt(), sign)))
    });
    let rings: BTreeMap<[u32; 2], (f64, f64, f64)> = rings.collect();
    let differences = rings.iter().flat_map(|(&[i, j], (mean, _, sign))| {
        let beside = [[i + 1, j], [i, j + 1]].into_iter().filter_map(|other| rings.get(&other));
        beside.map(|(other, ..)| sign * (mean - other)).collect::<Vec<_>>()
    });
    let contrast = upper_median(differences)?;
    let within = upper_median(rings.values().map(|(_, deviation, _)| *deviation))?;
    (contrast > 0.0).then(|| within / contrast)
}
