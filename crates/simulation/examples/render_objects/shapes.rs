//! Solids that only some parts need: flat bars with oval sections, bent strips, polygons with rounded corners.

use nalgebra::{Point2, Point3, Vector2, Vector3};
use sdg_simulation::shapes::mesh::{MeshVertex, TriangleMesh};
use sdg_simulation::shapes::solids::METRES_PER_REPEAT;

/// A polygon (counter-clockwise) with rounded corners, each given as `(x, y, radius)`; the radius of a sharp corner is
/// 0.
pub fn rounded_polygon(corners: &[(f64, f64, f64)]) -> Vec<Point2<f64>> {
    const STEPS: usize = 6;
    let count = corners.len();
    let at = |idx: usize| Point2::new(corners[idx % count].0, corners[idx % count].1);
    let mut points = Vec::new();
    for (idx, &(x, y, radius)) in corners.iter().enumerate() {
        let (before, corner, after) = (at(idx + count - 1), Point2::new(x, y), at(idx + 1));
        let (into, out) = ((corner - before).normalize(), (after - corner).normalize());
        let turn = (into.x * out.y - into.y * out.x).atan2(into.dot(&out));
        if radius == 0.0 || turn.abs() < 1e-6 {
            points.push(corner);
            continue;
        }
        let start = corner - into * (radius * (turn / 2.0).tan().abs());
        let to_centre = Vector2::new(-into.y, into.x) * turn.signum();
        let centre = start + to_centre * radius;
        for step in 0..=STEPS {
            let angle = turn * step as f64 / STEPS as f64;
            points.push(centre + nalgebra::Rotation2::new(angle) * (start - centre));
        }
    }
    points
}

/// The mirror image of a polygon across the x axis, counter-clockwise again.
pub fn mirrored(polygon: &[Point2<f64>]) -> Vec<Point2<f64>> {
    polygon.iter().rev().map(|point| Point2::new(point.x, -point.y)).collect()
}

/// Points of a cubic Bézier curve from its first to its last control point.
pub fn bezier(controls: [Point2<f64>; 4], steps: usize) -> Vec<Point2<f64>> {
    (0..=steps)
        .map(|step| {
            let t = step as f64 / steps as f64;
            let weights = [(1.0 - t).powi(3), 3.0 * t * (1.0 - t).powi(2), 3.0 * t * t * (1.0 - t), t.powi(3)];
            Point2::from(
                controls.iter().zip(weights).map(|(point, weight)| point.coords * weight).sum::<Vector2<f64>>(),
            )
        })
        .collect()
}

/// A bar along a horizontal path at height `z`; its section is an ellipse with squared flanks (a superellipse).
///
/// `half_size` returns half width and half height at a position from 0 (start of the path) to 1 (its end).
pub fn oval_bar(path: &[Point2<f64>], z: f64, half_size: impl Fn(f64) -> (f64, f64)) -> TriangleMesh {
    const SEGMENTS: usize = 24;
    const POWER: f64 = 0.6;
    let count = path.len();
    let squared = |value: f64| value.signum() * value.abs().powf(POWER);
    let mut mesh = TriangleMesh::default();
    // The first and the last row close the ends.
    mesh.push_grid(count + 2, SEGMENTS + 1, |row, col| {
        let idx = row.clamp(1, count) - 1;
        let tangent = (path[(idx + 1).min(count - 1)] - path[idx.max(1) - 1]).normalize();
        let side = Vector3::new(tangent.y, -tangent.x, 0.0);
        let (half_width, half_height) = half_size(idx as f64 / (count - 1) as f64);
        let closed = if row == 0 || row == count + 1 { 0.0 } else { 1.0 };
        let angle = std::f64::consts::TAU * (col % SEGMENTS) as f64 / SEGMENTS as f64;
        let position = Point3::new(path[idx].x, path[idx].y, z)
            + Vector3::z() * (half_height * squared(angle.cos()) * closed)
            + side * (half_width * squared(angle.sin()) * closed);
        MeshVertex { position, texcoord: Point2::from(position.coords.xy() / METRES_PER_REPEAT) }
    });
    mesh
}

/// A strip of sheet bent along a path (x, z), centred on y = 0.
///
/// `half_width` returns half the width at a distance along the path in metres.
pub fn bent_strip(path: &[Point2<f64>], thickness: f64, half_width: impl Fn(f64) -> f64) -> TriangleMesh {
    // Corners of the section as (towards the left of the path, towards -y), counter-clockwise about the path.
    const SECTION: [(f64, f64); 4] = [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)];
    let count = path.len();
    let mut along = vec![0.0];
    for pair in path.windows(2) {
        along.push(along[along.len() - 1] + (pair[1] - pair[0]).norm());
    }
    let mut mesh = TriangleMesh::default();
    mesh.push_grid(count + 2, SECTION.len() + 1, |row, col| {
        let idx = row.clamp(1, count) - 1;
        let tangent = (path[(idx + 1).min(count - 1)] - path[idx.max(1) - 1]).normalize();
        let closed = if row == 0 || row == count + 1 { 0.0 } else { 1.0 };
        let (up, side) = SECTION[col % SECTION.len()];
        let lift = up * thickness / 2.0 * closed;
        let y = -side * half_width(along[idx]) * closed;
        let position = Point3::new(path[idx].x - tangent.y * lift, y, path[idx].y + tangent.x * lift);
        MeshVertex { position, texcoord: Point2::new(along[idx] / METRES_PER_REPEAT, y / METRES_PER_REPEAT) }
    });
    mesh
}

/// A polyline through the same corners in steps of at most `step` metres.
pub fn resampled(path: &[Point2<f64>], step: f64) -> Vec<Point2<f64>> {
    let mut points = vec![path[0]];
    for pair in path.windows(2) {
        let parts = ((pair[1] - pair[0]).norm() / step).ceil().max(1.0);
        points.extend((1..=parts as usize).map(|part| pair[0] + (pair[1] - pair[0]) * (part as f64 / parts)));
    }
    points
}
