//! Outlines of obstacles from above, in the base frame, in metres.

use std::f64::consts::TAU;

use nalgebra::{Isometry3, Point2, Point3, Vector2, Vector3};
use sdg_geometry::convex_hull;
use sdg_kinematics::collision::{Obstacle, Shape};

/// Range of heights above the table, at z = 0, in which an obstacle overlaps a part that lies there. Below it are
/// obstacles that end at the table, with their rounding errors; above it is more than the height of any part.
const PART_HEIGHTS_M: [f64; 2] = [1e-6, 0.12];
/// Extent of the area of a plane's solid side: more than the arm's reach.
const PLANE_M: f64 = 5.0;
/// Smallest horizontal part of a plane's unit normal for a plane that divides the table.
const MIN_SLOPE: f64 = 1e-3;

/// The outline of an obstacle; `None` for a plane.
pub(crate) fn seen_from_above(obstacle: &Obstacle) -> Option<Vec<Point2<f64>>> {
    Some(convex_hull(outer_points(obstacle)?.iter().map(|p| p.xy())))
}

/// Convex outlines of the obstacles that a part on a table at z = 0 must avoid: solids that are neither completely
/// below the table nor above every part, and the solid sides of planes that divide the table.
pub fn footprints_on_table(obstacles: &[Obstacle]) -> Vec<Vec<Point2<f64>>> {
    obstacles.iter().filter_map(footprint_on_table).collect()
}

fn footprint_on_table(obstacle: &Obstacle) -> Option<Vec<Point2<f64>>> {
    let Some(points) = outer_points(obstacle) else { return solid_side(&obstacle.base_from_obstacle) };
    let [low_m, high_m] = PART_HEIGHTS_M;
    let is_on_table = points.iter().any(|p| p.z < high_m) && points.iter().any(|p| p.z > low_m);
    is_on_table.then(|| convex_hull(points.iter().map(|p| p.xy())))
}

/// Points whose convex hull is the obstacle, except for the arcs between them; `None` for a plane.
fn outer_points(obstacle: &Obstacle) -> Option<Vec<Point3<f64>>> {
    let Obstacle { shape, base_from_obstacle, .. } = obstacle;
    let ring = |radius_m: f64, z: f64| {
        (0..48).map(move |i| {
            let (sin, cos) = (TAU * f64::from(i) / 48.0).sin_cos();
            Point3::new(radius_m * cos, radius_m * sin, z)
        })
    };
    let points: Vec<Point3<f64>> = match *shape {
        Shape::Plane => return None,
        Shape::Box { half_m: [a, b, c] } => {
            let sign = |corner: usize, axis: usize| if corner >> axis & 1 == 0 { -1.0 } else { 1.0 };
            (0..8).map(|i| Point3::new(sign(i, 0) * a, sign(i, 1) * b, sign(i, 2) * c)).collect()
        }
        Shape::Cylinder { radius_m, half_length_m } => {
            [-half_length_m, half_length_m].into_iter().flat_map(|z| ring(radius_m, z)).collect()
        }
        Shape::Capsule { radius_m, half_length_m } => {
            // Spheres at both ends: in any orientation a level circle, the top and the bottom.
            let ends = [-half_length_m, half_length_m].map(|z| base_from_obstacle * Point3::new(0.0, 0.0, z));
            let poles = [-radius_m, radius_m].map(|z| Point3::new(0.0, 0.0, z));
            let of_end = |end: Point3<f64>| ring(radius_m, 0.0).chain(poles).map(move |p| end + p.coords);
            return Some(ends.into_iter().flat_map(of_end).collect());
        }
    };
    Some(points.iter().map(|p| base_from_obstacle * p).collect())
}

/// The part of a table at z = 0 that is in the solid of a plane; `None` for a level plane.
fn solid_side(base_from_plane: &Isometry3<f64>) -> Option<Vec<Point2<f64>>> {
    let normal = base_from_plane.rotation * Vector3::z();
    let slope = normal.xy().norm();
    if slope < MIN_SLOPE {
        return None;
    }
    let outward = normal.xy() / slope;
    let along = Vector2::new(-outward.y, outward.x);
    let edge_m = normal.dot(&base_from_plane.translation.vector) / slope;
    let corner = |depth_m: f64, side_m: f64| Point2::from(outward * (edge_m - depth_m) + along * side_m);
    Some(vec![corner(0.0, -PLANE_M), corner(0.0, PLANE_M), corner(PLANE_M, PLANE_M), corner(PLANE_M, -PLANE_M)])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn obstacle(shape: Shape, base_from_obstacle: Isometry3<f64>) -> Obstacle {
        Obstacle { name: "o".to_owned(), shape, base_from_obstacle }
    }

    fn reach(outline: &[Point2<f64>], along: fn(&Point2<f64>) -> f64) -> f64 {
        outline.iter().map(along).fold(f64::NEG_INFINITY, f64::max)
    }

    #[test]
    fn obstacles_are_seen_from_above() {
        let turned = Isometry3::new(Vector3::new(0.5, 0.1, 0.2), Vector3::z() * std::f64::consts::FRAC_PI_2);
        let outline = seen_from_above(&obstacle(Shape::Box { half_m: [0.1, 0.02, 0.3] }, turned)).unwrap();
        assert!((reach(&outline, |p| p.x) - 0.52).abs() < 1e-9, "{outline:?}");
        assert!((reach(&outline, |p| p.y) - 0.2).abs() < 1e-9, "{outline:?}");
        assert_eq!(seen_from_above(&obstacle(Shape::Plane, turned)), None);
    }

    #[test]
    fn only_obstacles_at_the_height_of_parts_take_room_on_the_table() {
        let shapes = [
            Shape::Box { half_m: [0.1, 0.05, 0.05] },
            Shape::Cylinder { radius_m: 0.05, half_length_m: 0.05 },
            Shape::Capsule { radius_m: 0.03, half_length_m: 0.02 },
        ];
        for shape in shapes {
            let taken = |z: f64| footprints_on_table(&[obstacle(shape, Isometry3::translation(0.5, 0.1, z))]);
            assert_eq!([-0.05, 0.05, 0.16, 0.18].map(|z| taken(z).len()), [0, 1, 1, 0], "{shape:?}");
        }
    }

    #[test]
    fn the_solid_side_of_a_wall_is_taken() {
        // A wall at y = 0.1 whose solid is at larger y: its normal is -y.
        let turn = Vector3::x() * std::f64::consts::FRAC_PI_2;
        let wall = obstacle(Shape::Plane, Isometry3::new(Vector3::new(0.3, 0.1, 0.4), turn));
        let level = obstacle(Shape::Plane, Isometry3::translation(0.0, 0.0, -0.1));
        let taken = footprints_on_table(&[wall, level]);
        assert_eq!(taken.len(), 1);
        assert!((reach(&taken[0], |p| -p.y) + 0.1).abs() < 1e-9 && reach(&taken[0], |p| p.y) > 5.0, "{taken:?}");
    }
}
