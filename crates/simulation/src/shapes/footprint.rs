//! Areas of objects on the table: convex outlines seen from above, and the distance between two of them.

use nalgebra::{Isometry2, Point2, Vector2};

/// Moves an outline to its pose on the table.
pub fn placed(outline: &[Point2<f64>], table_from_outline: &Isometry2<f64>) -> Vec<Point2<f64>> {
    outline.iter().map(|point| table_from_outline * point).collect()
}

/// The largest gap between two convex outlines along the normals of their edges; negative if they overlap.
///
/// This is the true distance if the nearest points include an inner point of an edge. If both nearest points are
/// corners, it can be less than the true distance.
pub fn separation(a: &[Point2<f64>], b: &[Point2<f64>]) -> f64 {
    let along = |normal: &Vector2<f64>, points: &[Point2<f64>]| {
        points
            .iter()
            .map(|point| normal.dot(&point.coords))
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), at| (low.min(at), high.max(at)))
    };
    let gaps = |from: &[Point2<f64>], to: &[Point2<f64>]| {
        (0..from.len())
            .map(|idx| {
                let edge = from[(idx + 1) % from.len()] - from[idx];
                let normal = Vector2::new(edge.y, -edge.x).normalize();
                along(&normal, to).0 - along(&normal, from).1
            })
            .fold(f64::NEG_INFINITY, f64::max)
    };
    gaps(a, b).max(gaps(b, a))
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use sdg_geometry::convex_hull;

    fn square(x: f64, y: f64) -> Vec<Point2<f64>> {
        convex_hull(
            [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0), (0.5, 0.5), (0.5, 0.0)]
                .map(|(u, v)| Point2::new(x + u, y + v)),
        )
    }

    #[test]
    fn squares_are_as_far_apart_as_they_look() {
        assert_relative_eq!(separation(&square(0.0, 0.0), &square(1.25, 0.3)), 0.25);
        assert_relative_eq!(separation(&square(0.0, 0.0), &square(0.75, 0.9)), -0.1);
        let turned = placed(&square(-0.5, -0.5), &Isometry2::new(Vector2::new(2.0, 0.5), std::f64::consts::FRAC_PI_4));
        assert_relative_eq!(separation(&square(0.0, 0.0), &turned), 1.0 - 0.5 * 2f64.sqrt(), epsilon = 1e-12);
    }
}
