//! Refines corners to subpixel accuracy.
//!
//! Legend: `g` a brightness gradient at pixel `p`, `q` the corner, `w` a Gaussian weight. On both edges the gradient is
//! perpendicular to the vector from the corner, and inside the squares `g = 0`: everywhere `gᵀ (p - q) = 0`. Least
//! squares over a window give `q = (Σ w g gᵀ)⁻¹ Σ w g gᵀ p`.
//!
//! # Source
//! Förstner and Gülch 1987; OpenCV's `cornerSubPix` minimises the same sum over a square window.

use nalgebra::{Matrix2, Point2, Vector2};

use super::dots::Placed;
use super::grid::Grid;
use super::luminance::Luminance;
use super::seen_corner::SeenCorner;

/// Radius of the window, in sides of a square: the window contains neither the next edge nor a dot.
const WINDOW: f64 = 0.38;
/// Minimum and maximum radius of the window, in pixels: smaller windows have too few gradients, and in larger ones the
/// lens's distortion bends the edges.
const WINDOWS_PX: [f64; 2] = [2.5, 24.0];
/// Standard deviation of the weight, in radii of the window.
const SIGMA: f64 = 0.5;
const MAX_STEPS: usize = 30;
/// Step size at which the iteration ends, in pixels.
const TOLERANCE_PX: f64 = 1e-3;
/// Largest movement of a corner from its position in the grid, in sides of a square.
const MAX_MOVE: f64 = 0.3;

/// The refined corners of the grid, with their positions on the board. Corners that are unclear or near the picture's
/// border are left out.
pub(super) fn refine(picture: &Luminance, grid: &Grid, placed: &Placed) -> Vec<SeenCorner> {
    let refined = placed.iter().filter_map(|(place, corner)| {
        let side = grid.width(*place)?;
        let start = grid.corners[place];
        let pixel = corner_near(picture, start, (WINDOW * side).clamp(WINDOWS_PX[0], WINDOWS_PX[1]))?;
        ((pixel - start).norm() < MAX_MOVE * side).then_some(SeenCorner { corner: *corner, pixel })
    });
    refined.collect()
}

fn corner_near(picture: &Luminance, start: Point2<f64>, radius: f64) -> Option<Point2<f64>> {
    let mut corner = start;
    for _ in 0..MAX_STEPS {
        let next = step(picture, &corner, radius)?;
        let moved = (next - corner).norm();
        corner = next;
        if moved < TOLERANCE_PX {
            break;
        }
    }
    Some(corner)
}

fn step(picture: &Luminance, corner: &Point2<f64>, radius: f64) -> Option<Point2<f64>> {
    let [left, top] = [corner.x - radius, corner.y - radius].map(|value| (value - 0.5).ceil());
    let [right, bottom] = [corner.x + radius, corner.y + radius].map(|value| (value - 0.5).floor());
    // The gradient at a pixel needs a neighbour on each side.
    if left < 1.0 || top < 1.0 || right + 1.0 >= picture.width as f64 || bottom + 1.0 >= picture.height as f64 {
        return None;
    }
    let (mut normal, mut side) = (Matrix2::zeros(), Vector2::zeros());
    for y in top as usize..=bottom as usize {
        for x in left as usize..=right as usize {
            let way = Vector2::new(x as f64 + 0.5, y as f64 + 0.5) - corner.coords;
            let distance = way.norm_squared() / (radius * radius);
            if distance > 1.0 {
                continue;
            }
            let weight = (-0.5 * distance / (SIGMA * SIGMA)).exp();
            let difference = |a: f32, b: f32| f64::from(a - b);
            let gradient = Vector2::new(
                difference(picture.at(x + 1, y), picture.at(x - 1, y)),
                difference(picture.at(x, y + 1), picture.at(x, y - 1)),
            );
            let outer = gradient * gradient.transpose() * weight;
            normal += outer;
            side += outer * way;
        }
    }
    // A single edge does not determine the position along it.
    let [a, b]: [f64; 2] = normal.symmetric_eigenvalues().into();
    if a.min(b) <= 0.01 * a.max(b) {
        return None;
    }
    Some(corner + normal.try_inverse()? * side)
}
