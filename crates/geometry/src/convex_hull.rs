//! The convex hull of points.

use nalgebra::Point2;

/// Smaller cross products are rounding errors.
const MIN_CROSS: f64 = 1e-12;

/// The convex hull of points (Andrew's monotone chain): counter-clockwise where y points up, without points on its
/// edges. Fewer than three different points are returned sorted, each once.
pub fn convex_hull(points: impl IntoIterator<Item = Point2<f64>>) -> Vec<Point2<f64>> {
    let mut points: Vec<Point2<f64>> = points.into_iter().collect();
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    points.dedup();
    if points.len() < 3 {
        return points;
    }
    let turns_left = |a: Point2<f64>, b: Point2<f64>, c: Point2<f64>| (b - a).perp(&(c - a)) > MIN_CROSS;
    let half = |points: &mut dyn Iterator<Item = Point2<f64>>| {
        let mut chain: Vec<Point2<f64>> = Vec::new();
        for point in points {
            while chain.len() >= 2 && !turns_left(chain[chain.len() - 2], chain[chain.len() - 1], point) {
                chain.pop();
            }
            chain.push(point);
        }
        chain.pop();
        chain
    };
    let mut hull = half(&mut points.iter().copied());
    hull.extend(half(&mut points.iter().rev().copied()));
    hull
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keeps_the_corners_only() {
        let points = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0), (0.5, 0.5), (0.5, 0.0)];
        let corners = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)];
        assert_eq!(convex_hull(points.map(|(x, y)| Point2::new(x, y))), corners.map(|(x, y)| Point2::new(x, y)));
        assert_eq!(convex_hull([Point2::new(2.0, 1.0); 3]), [Point2::new(2.0, 1.0)]);
    }
}
