//! Capsules, and the distance between two segments.

use nalgebra::{Isometry3, Point3};

/// All points within `radius_m` of the segment from `from` to `to`, in the frame of a body, m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Capsule {
    /// One end of the segment.
    pub from: Point3<f64>,
    /// The other end.
    pub to: Point3<f64>,
    /// Distance of the surface from the segment, in metres.
    pub radius_m: f64,
}

impl Capsule {
    /// Creates a capsule from the coordinates of both ends and the radius, m.
    pub const fn new(from: [f64; 3], to: [f64; 3], radius_m: f64) -> Self {
        Self { from: Point3::new(from[0], from[1], from[2]), to: Point3::new(to[0], to[1], to[2]), radius_m }
    }

    /// The capsule in another frame.
    pub fn moved(&self, frame_from_body: &Isometry3<f64>) -> Self {
        Self { from: frame_from_body * self.from, to: frame_from_body * self.to, radius_m: self.radius_m }
    }

    /// Midpoint of the segment.
    pub fn middle(&self) -> Point3<f64> {
        nalgebra::center(&self.from, &self.to)
    }

    /// The nearest points of the segments of two capsules in the same frame.
    pub fn nearest_points(&self, other: &Self) -> (Point3<f64>, Point3<f64>) {
        let (u, v, w) = (self.to - self.from, other.to - other.from, self.from - other.from);
        let (s, t) = nearest_shares(u.into(), v.into(), w.into());
        (self.from + u * s, other.from + v * t)
    }

    /// Distance between the surfaces of two capsules in the same frame, m; negative where they overlap.
    pub fn distance_m(&self, other: &Self) -> f64 {
        let (own, others) = self.nearest_points(other);
        (own - others).norm() - self.radius_m - other.radius_m
    }
}

/// The closest points of two segments, as fractions of their lengths.
///
/// `u` and `v` are the vectors from the segments' starts to their ends, `w` the vector from the second start to the
/// first.
///
/// # Source
/// C. Ericson, *Real-Time Collision Detection*, 5.1.9; without branches, so that it can be computed in SIMD lanes.
#[inline(always)]
pub(crate) fn nearest_shares(u: [f64; 3], v: [f64; 3], w: [f64; 3]) -> (f64, f64) {
    /// A segment with a smaller squared length is a point, m².
    const POINT: f64 = 1e-18;
    /// Two segments are parallel if the squared sine of their angle is below this. Any fraction of the first segment
    /// is then valid, and the distance is too large by at most a millionth of the longer segment's length.
    const PARALLEL: f64 = 1e-12;
    let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let (uu, vv, uv, uw, vw) = (dot(u, u), dot(v, v), dot(u, v), dot(u, w), dot(v, w));
    let uu = if uu > POINT { uu } else { POINT };
    let vv = if vv > POINT { vv } else { POINT };
    let determinant = uu * vv - uv * uv;
    let is_parallel = determinant <= PARALLEL * uu * vv;
    let divisor = if is_parallel { 1.0 } else { determinant };
    let crossing = clamp((uv * vw - vv * uw) / divisor, 0.0, 1.0);
    let s = if is_parallel { 0.0 } else { crossing };
    let t = clamp((uv * s + vw) / vv, 0.0, 1.0);
    (clamp((uv * t - uw) / uu, 0.0, 1.0), t)
}

#[inline(always)]
pub(crate) fn clamp(x: f64, low: f64, high: f64) -> f64 {
    let x = if x > low { x } else { low };
    if x < high { x } else { high }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;
    use rand::{Rng, SeedableRng};
    use rand_pcg::Pcg64Mcg;

    #[test]
    fn distances_that_can_be_computed_by_hand() {
        let along_x = Capsule::new([0.0, 0.0, 0.0], [1.0, 0.0, 0.0], 0.1);
        // Crossing above, beside the end, parallel, overlapping, and a sphere.
        for (other, expected) in [
            (Capsule::new([0.5, -1.0, 0.5], [0.5, 1.0, 0.5], 0.2), 0.2),
            (Capsule::new([1.3, 0.4, 0.0], [2.0, 0.4, 0.0], 0.1), 0.3),
            (Capsule::new([0.2, 0.0, 0.7], [0.8, 0.0, 0.7], 0.1), 0.5),
            (Capsule::new([0.5, 0.0, 0.0], [0.5, 0.0, 1.0], 0.1), -0.2),
            (Capsule::new([0.0, 3.0, 4.0], [0.0, 3.0, 4.0], 0.5), 4.4),
        ] {
            assert!((along_x.distance_m(&other) - expected).abs() < 1e-12, "{other:?}");
            assert!((other.distance_m(&along_x) - expected).abs() < 1e-12, "{other:?}");
        }
    }

    #[test]
    fn distances_agree_with_points_on_the_segments() {
        let mut rng = Pcg64Mcg::seed_from_u64(7);
        let mut point = || Point3::from(Vector3::from_fn(|_, _| rng.random_range(-1.0..1.0)));
        for _ in 0..200 {
            let one = Capsule { from: point(), to: point(), radius_m: 0.0 };
            let other = Capsule { from: point(), to: point(), radius_m: 0.0 };
            let mut sampled = f64::INFINITY;
            for i in 0..=200 {
                for k in 0..=200 {
                    let (s, t) = (f64::from(i) / 200.0, f64::from(k) / 200.0);
                    let (p, q) = (one.from + (one.to - one.from) * s, other.from + (other.to - other.from) * t);
                    sampled = sampled.min((p - q).norm());
                }
            }
            let found = one.distance_m(&other);
            // The distance of samples from the closest point on each segment is at most 2 · √3 / 400.
            assert!(found <= sampled + 1e-12 && found > sampled - 0.018, "{found} {sampled}");
        }
    }
}
