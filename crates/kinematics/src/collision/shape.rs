//! Shapes of obstacles: their signed distances, and their closest points to segments.
//!
//! Every shape is convex, and the signed distance to a convex set is a convex function: it has one minimum along a
//! segment, which is found by bisection of its slope. This applies to all shapes, inside and outside.

use crate::capsule::clamp;
use nalgebra::{Point3, Vector3};

/// A solid obstacle in its own frame, m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Shape {
    /// All points with z ≤ 0: a table or a floor; rotated, a wall.
    Plane,
    /// A box around the origin.
    Box {
        /// Half of the lengths along x, y and z.
        half_m: [f64; 3],
    },
    /// A cylinder around z.
    Cylinder {
        /// Distance of the surface from the axis, in metres.
        radius_m: f64,
        /// Half of the length along z.
        half_length_m: f64,
    },
    /// All points within a radius of a segment on the z axis; a sphere if the segment has length 0.
    Capsule {
        /// Distance of the surface from the axis, in metres.
        radius_m: f64,
        /// Half of the segment's length.
        half_length_m: f64,
    },
}

/// Signed distance of a point and, up to a positive factor, its derivative along a direction.
pub(super) type DistanceAndSlope = (f64, f64);

impl Shape {
    /// Signed distance from a point to the surface, m; negative inside.
    pub fn signed_distance_m(&self, p: &Point3<f64>) -> f64 {
        self.distance_and_slope([p.x, p.y, p.z], [0.0; 3]).0
    }

    /// The direction of the steepest increase of the signed distance, of unit length.
    pub fn outward_normal(&self, p: &Point3<f64>) -> Vector3<f64> {
        let p = [p.x, p.y, p.z];
        let slope = |axis: usize| {
            let mut direction = [0.0; 3];
            direction[axis] = 1.0;
            self.distance_and_slope(p, direction).1
        };
        // A point on the axis of a cylinder or capsule has no unique nearest surface point; any direction is valid.
        Vector3::new(slope(0), slope(1), slope(2)).try_normalize(0.0).unwrap_or_else(Vector3::x)
    }

    /// The closest point of a segment, as a fraction of the length from `from` to `to`, and its signed distance.
    pub fn nearest_on_segment(&self, from: &Point3<f64>, to: &Point3<f64>) -> (f64, f64) {
        const NUM_BISECTIONS: usize = 48;
        let along = to - from;
        let direction = [along.x, along.y, along.z];
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..NUM_BISECTIONS {
            let middle: f64 = 0.5 * (low + high);
            let p = from + along * middle;
            if self.distance_and_slope([p.x, p.y, p.z], direction).1 > 0.0 {
                high = middle;
            } else {
                low = middle;
            }
        }
        let share = 0.5 * (low + high);
        // If the slope does not change its sign, the closest point is exactly an end.
        let share = if low == 0.0 {
            0.0
        } else if high == 1.0 {
            1.0
        } else {
            share
        };
        (share, self.signed_distance_m(&(from + along * share)))
    }

    #[inline(always)]
    fn distance_and_slope(&self, p: [f64; 3], direction: [f64; 3]) -> DistanceAndSlope {
        match *self {
            Self::Plane => plane(p, direction),
            Self::Box { half_m } => solid_box(p, direction, half_m),
            Self::Cylinder { radius_m, half_length_m } => cylinder(p, direction, radius_m, half_length_m),
            Self::Capsule { radius_m, half_length_m } => capsule(p, direction, radius_m, half_length_m),
        }
    }
}

#[inline(always)]
pub(super) fn plane(p: [f64; 3], direction: [f64; 3]) -> DistanceAndSlope {
    (p[2], direction[2])
}

#[inline(always)]
pub(super) fn solid_box(p: [f64; 3], direction: [f64; 3], half: [f64; 3]) -> DistanceAndSlope {
    let q = [p[0].abs() - half[0], p[1].abs() - half[1], p[2].abs() - half[2]];
    let d = [with_sign(direction[0], p[0]), with_sign(direction[1], p[1]), with_sign(direction[2], p[2])];
    let out = [positive(q[0]), positive(q[1]), positive(q[2])];
    let squared = out[0] * out[0] + out[1] * out[1] + out[2] * out[2];
    let outside = squared.sqrt();
    let outside_slope = out[0] * d[0] + out[1] * d[1] + out[2] * d[2];
    // Inside the box, the closest face determines the distance.
    let (first, first_slope) = if q[0] > q[1] { (q[0], d[0]) } else { (q[1], d[1]) };
    let (inside, inside_slope) = if first > q[2] { (first, first_slope) } else { (q[2], d[2]) };
    if squared > 0.0 { (outside, outside_slope) } else { (inside, inside_slope) }
}

#[inline(always)]
pub(super) fn cylinder(p: [f64; 3], direction: [f64; 3], radius: f64, half_length: f64) -> DistanceAndSlope {
    let from_axis = (p[0] * p[0] + p[1] * p[1]).sqrt();
    let nonzero = if from_axis > f64::MIN_POSITIVE { from_axis } else { f64::MIN_POSITIVE };
    let radial_slope = (p[0] * direction[0] + p[1] * direction[1]) / nonzero;
    let axial_slope = with_sign(direction[2], p[2]);
    let q = [from_axis - radius, p[2].abs() - half_length];
    let out = [positive(q[0]), positive(q[1])];
    let squared = out[0] * out[0] + out[1] * out[1];
    let outside = squared.sqrt();
    let outside_slope = out[0] * radial_slope + out[1] * axial_slope;
    let (inside, inside_slope) = if q[0] > q[1] { (q[0], radial_slope) } else { (q[1], axial_slope) };
    if squared > 0.0 { (outside, outside_slope) } else { (inside, inside_slope) }
}

#[inline(always)]
pub(super) fn capsule(p: [f64; 3], direction: [f64; 3], radius: f64, half_length: f64) -> DistanceAndSlope {
    let nearest = clamp(p[2], -half_length, half_length);
    let z = p[2] - nearest;
    let distance = (p[0] * p[0] + p[1] * p[1] + z * z).sqrt();
    (distance - radius, p[0] * direction[0] + p[1] * direction[1] + z * direction[2])
}

/// `max(x, 0)` as one comparison. The standard library's version handles NaN, which prevents vectorisation.
#[inline(always)]
fn positive(x: f64) -> f64 {
    if x > 0.0 { x } else { 0.0 }
}

/// `value` times the sign of `of`.
#[inline(always)]
fn with_sign(value: f64, of: f64) -> f64 {
    if of < 0.0 { -value } else { value }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};
    use rand_pcg::Pcg64Mcg;

    const BOX: Shape = Shape::Box { half_m: [0.1, 0.2, 0.3] };
    const CYLINDER: Shape = Shape::Cylinder { radius_m: 0.1, half_length_m: 0.2 };
    const CAPSULE: Shape = Shape::Capsule { radius_m: 0.1, half_length_m: 0.2 };

    #[test]
    fn distances_that_can_be_computed_by_hand() {
        for (shape, p, expected) in [
            (Shape::Plane, [3.0, 4.0, -0.5], -0.5),
            (BOX, [0.4, 0.0, 0.0], 0.3),
            (BOX, [0.4, 0.6, 0.0], 0.5),
            (BOX, [0.08, 0.0, 0.0], -0.02),
            (CYLINDER, [0.0, 0.5, 0.1], 0.4),
            (CYLINDER, [0.3, 0.4, 0.5], 0.5),
            (CYLINDER, [0.0, 0.0, 0.15], -0.05),
            (CAPSULE, [0.0, 0.0, 0.5], 0.2),
            (CAPSULE, [0.3, 0.0, 0.6], 0.4),
            (CAPSULE, [0.0, 0.02, 0.1], -0.08),
        ] {
            let found = shape.signed_distance_m(&Point3::from(p));
            assert!((found - expected).abs() < 1e-12, "{shape:?} at {p:?}: {found}, expected {expected}");
        }
    }

    #[test]
    fn the_normal_is_the_gradient_of_the_distance() {
        const STEP: f64 = 1e-7;
        let mut rng = Pcg64Mcg::seed_from_u64(3);
        for shape in [Shape::Plane, BOX, CYLINDER, CAPSULE] {
            for _ in 0..300 {
                let p = Point3::from(Vector3::from_fn(|_, _| rng.random_range(-0.6..0.6)));
                let normal = shape.outward_normal(&p);
                let numeric = Vector3::from_fn(|axis, _| {
                    let mut step = Vector3::zeros();
                    step[axis] = STEP;
                    (shape.signed_distance_m(&(p + step)) - shape.signed_distance_m(&(p - step))) / (2.0 * STEP)
                });
                assert!((normal - numeric).norm() < 1e-5, "{shape:?} at {p}: {normal} {numeric}");
            }
        }
    }

    #[test]
    fn the_nearest_point_of_a_segment_agrees_with_many_points() {
        let mut rng = Pcg64Mcg::seed_from_u64(4);
        for shape in [Shape::Plane, BOX, CYLINDER, CAPSULE] {
            for _ in 0..200 {
                let [a, b]: [Point3<f64>; 2] =
                    std::array::from_fn(|_| Point3::from(Vector3::from_fn(|_, _| rng.random_range(-0.6..0.6))));
                let (share, found) = shape.nearest_on_segment(&a, &b);
                assert!((shape.signed_distance_m(&(a + (b - a) * share)) - found).abs() < 1e-12);
                let sampled = (0..=2000)
                    .map(|i| shape.signed_distance_m(&(a + (b - a) * (f64::from(i) / 2000.0))))
                    .fold(f64::INFINITY, f64::min);
                // The distance of samples from the closest point of the segment is at most half a step; a step is
                // 1/2000 of the segment.
                assert!(found <= sampled + 1e-9 && found > sampled - 6e-4, "{shape:?}: {found} {sampled}");
            }
        }
    }
}
