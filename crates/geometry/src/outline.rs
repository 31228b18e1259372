//! The outline of a part in a picture, similar to one marked carefully by a person: traced from a mask, then
//! simplified.

use nalgebra::Point2;

use crate::{Mask, Polygon};

/// Maximum number of vertices: about as many as a careful person marks.
const MAX_VERTICES: usize = 56;

/// Initial maximum distance of the simplified outline from the traced one, in pixels.
const MIN_TOLERANCE_PX: f64 = 0.35;

/// The outer outline of the largest piece of a mask, without holes; `None` for an empty mask, and if that outline
/// consists of fewer than 12 edges of pixels.
///
/// It has at most 56 vertices.
///
/// # Units and frames
/// Pixels; the centre of the first pixel is (0.5, 0.5). The points run clockwise (y points down).
pub fn outer_outline(mask: &Mask) -> Option<Polygon> {
    let Polygon { vertices: traced } = outer_boundary(mask)?;
    let mut tolerance = MIN_TOLERANCE_PX;
    loop {
        let vertices = simplify_ring(&traced, tolerance);
        if vertices.len() <= MAX_VERTICES {
            return Polygon::new(vertices).ok();
        }
        tolerance *= 1.1;
    }
}

/// As [`outer_outline`], but not simplified: the pixels of the mask inside it are exactly those of the piece and of its
/// holes.
// Follows the pixels' edges with the mask on the right-hand side, once around each boundary; the boundary of the
// largest area is the outer outline of the largest piece.
pub fn outer_boundary(mask: &Mask) -> Option<Polygon> {
    let (width, height) = (mask.width() as i64, mask.height() as i64);
    let inside = |x: i64, y: i64| x >= 0 && y >= 0 && x < width && y < height && mask.get(x as u32, y as u32);
    // An upper edge has a pixel of the mask below it and none above; each boundary has at least one upper edge.
    let mut seen = vec![false; (width * height) as usize];
    let mut best: Option<(f64, Vec<Point2<f64>>)> = None;
    for y in 0..height {
        for x in 0..width {
            if !inside(x, y) || inside(x, y - 1) || seen[(y * width + x) as usize] {
                continue;
            }
            let (mut at, mut heading) = ((x, y), (1i64, 0i64));
            let mut corners: Vec<Point2<f64>> = Vec::new();
            loop {
                if heading == (1, 0) {
                    seen[(at.1 * width + at.0) as usize] = true;
                }
                // Midpoints of the pixels' edges: they smooth the steps of the boundary.
                let middle = |a: i64, step: i64| a as f64 + 0.5 * step as f64;
                corners.push(Point2::new(middle(at.0, heading.0), middle(at.1, heading.1)));
                at = (at.0 + heading.0, at.1 + heading.1);
                let right = (-heading.1, heading.0);
                // The two pixels ahead, on both sides of the path.
                let ahead = |side: (i64, i64)| {
                    let x = at.0 + (heading.0 + side.0 - 1).div_euclid(2);
                    let y = at.1 + (heading.1 + side.1 - 1).div_euclid(2);
                    inside(x, y)
                };
                let left = (heading.1, -heading.0);
                heading = if !ahead(right) {
                    right
                } else if ahead(left) {
                    left
                } else {
                    heading
                };
                if at == (x, y) && heading == (1, 0) {
                    break;
                }
            }
            let area: f64 = signed_area(&corners);
            if area > best.as_ref().map_or(0.0, |(area, _)| *area) {
                best = Some((area, corners));
            }
        }
    }
    best.map(|(_, corners)| Polygon { vertices: corners }).filter(|boundary| boundary.vertices.len() >= 12)
}

/// Positive for a ring that runs clockwise with y down; holes run in the opposite direction.
fn signed_area(ring: &[Point2<f64>]) -> f64 {
    (0..ring.len()).map(|idx| ring[idx].coords.perp(&ring[(idx + 1) % ring.len()].coords)).sum::<f64>() / 2.0
}

/// Douglas and Peucker's simplification of a closed ring, split at two vertices far from each other.
fn simplify_ring(ring: &[Point2<f64>], tolerance: f64) -> Vec<Point2<f64>> {
    let far_from = |from: usize| {
        (0..ring.len())
            .max_by(|&a, &b| (ring[a] - ring[from]).norm().total_cmp(&(ring[b] - ring[from]).norm()))
            .unwrap_or(0)
    };
    let (first, second) = (far_from(0), far_from(far_from(0)));
    let mut open: Vec<Point2<f64>> = ring[first..].iter().chain(&ring[..=first]).copied().collect();
    let split = (second + ring.len() - first) % ring.len();
    let mut keep = vec![false; open.len()];
    keep[0] = true;
    keep[split] = true;
    mark_kept(&open, 0, split, tolerance, &mut keep);
    mark_kept(&open, split, open.len() - 1, tolerance, &mut keep);
    let mut kept = keep.iter();
    open.retain(|_| *kept.next().unwrap_or(&false));
    open
}

fn mark_kept(points: &[Point2<f64>], from: usize, to: usize, tolerance: f64, keep: &mut [bool]) {
    let chord = points[to] - points[from];
    let distance = |idx: usize| {
        let along = points[idx] - points[from];
        let length = chord.norm();
        if length > 0.0 { (chord.perp(&along) / length).abs() } else { along.norm() }
    };
    let Some(farthest) = (from + 1..to).max_by(|&a, &b| distance(a).total_cmp(&distance(b))) else {
        return;
    };
    if distance(farthest) > tolerance {
        keep[farthest] = true;
        mark_kept(points, from, farthest, tolerance, keep);
        mark_kept(points, farthest, to, tolerance, keep);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ring_gives_its_outer_circle() {
        let distance =
            |x: u32, y: u32| ((f64::from(x) + 0.5 - 60.0).powi(2) + (f64::from(y) + 0.5 - 50.0).powi(2)).sqrt();
        let mask = Mask::from_fn(120, 100, |x, y| (20.0..40.0).contains(&distance(x, y)));
        let outline = outer_outline(&mask).unwrap();
        assert!((20..=MAX_VERTICES).contains(&outline.vertices.len()), "{}", outline.vertices.len());
        for vertex in &outline.vertices {
            let radius = (vertex - Point2::new(60.0, 50.0)).norm();
            assert!((radius - 40.0).abs() < 0.8, "{vertex} at {radius}");
        }
        assert!(!outline.crosses_itself());
    }

    #[test]
    fn rectangle_keeps_its_place_to_a_pixel_and_specks_are_left_out() {
        let mask = Mask::from_fn(60, 40, |x, y| ((10..50).contains(&x) && (5..25).contains(&y)) || (x, y) == (2, 30));
        let outline = outer_outline(&mask).unwrap();
        let bounds = outline.bounds();
        assert_eq!((bounds.x1, bounds.y1, bounds.x2, bounds.y2), (10.0, 5.0, 50.0, 25.0));
        let filled = outline.rasterize(60, 40);
        let alone = Mask::from_fn(60, 40, |x, y| (10..50).contains(&x) && (5..25).contains(&y));
        assert!(filled.iou(&alone) > 0.99, "{}", filled.iou(&alone));
    }

    #[test]
    fn the_boundary_encloses_the_largest_piece_and_its_holes() {
        // A rectangle without one corner, where another piece touches it diagonally.
        let piece = |x: u32, y: u32| (3..12).contains(&x) && (2..9).contains(&y) && (x, y) != (11, 8);
        let mask = Mask::from_fn(20, 15, |x, y| (piece(x, y) && (x, y) != (6, 5)) || (x, y) == (11, 9) || x > 16);
        let filled = outer_boundary(&mask).unwrap().rasterize(20, 15);
        assert_eq!(filled, Mask::from_fn(20, 15, piece));
    }

    #[test]
    fn empty_mask_has_no_outline() {
        assert!(outer_outline(&Mask::empty(20, 20)).is_none());
    }

    #[test]
    fn diagonal_neighbours_do_not_trap_the_walk() {
        let mask = Mask::from_fn(30, 30, |x, y| (x < 15) == (y < 15));
        let outline = outer_outline(&mask).unwrap();
        assert!((outline.area().abs() - 225.0).abs() < 6.0, "{}", outline.area());
    }
}
