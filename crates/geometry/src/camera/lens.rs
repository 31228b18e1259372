//! Lens distortion with the five coefficients that ROS and OpenCV call `plumb_bob`.
//!
//! Legend: `(x, y)` a point at depth 1 as a pinhole shows it, `(x', y')` its position through the lens, `r² = x² + y²`:
//! ```text
//! x' = x (1 + k1 r² + k2 r⁴ + k3 r⁶) + 2 p1 x y + p2 (r² + 2 x²)
//! y' = y (1 + k1 r² + k2 r⁴ + k3 r⁶) + p1 (r² + 2 y²) + 2 p2 x y
//! ```
//! Outside the calibrated picture, the fitted polynomial may decrease again from some radius on: it would map points
//! beyond that radius back into the picture. Such points are treated as not visible.

use nalgebra::{Matrix2, Point2, Vector2};
use serde::{Deserialize, Serialize};

/// The coefficients; all 0 for no distortion.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct PlumbBob {
    /// Radial coefficient of `r²`.
    pub k1: f64,
    /// Radial coefficient of `r⁴`.
    pub k2: f64,
    /// Tangential coefficient.
    pub p1: f64,
    /// Tangential coefficient.
    pub p2: f64,
    /// Radial coefficient of `r⁶`.
    pub k3: f64,
}

/// Maximum number of steps of Newton's method. Five suffice for existing lenses.
const MAX_STEPS: usize = 30;
/// Tolerance of Newton's method, at depth 1: less than a millionth of a pixel.
const TOLERANCE: f64 = 1e-10;

impl PlumbBob {
    /// No distortion.
    pub const NONE: Self = Self { k1: 0.0, k2: 0.0, p1: 0.0, p2: 0.0, k3: 0.0 };

    /// The coefficients in the order of ROS and OpenCV: k1, k2, p1, p2, k3.
    pub fn from_array([k1, k2, p1, p2, k3]: [f64; 5]) -> Self {
        Self { k1, k2, p1, p2, k3 }
    }

    /// The coefficients in the order of ROS and OpenCV: k1, k2, p1, p2, k3.
    pub fn to_array(self) -> [f64; 5] {
        [self.k1, self.k2, self.p1, self.p2, self.k3]
    }

    /// The position of a point at depth 1 through the lens; `None` beyond the radius at which the polynomial decreases
    /// again.
    pub fn distort(&self, point: &Point2<f64>) -> Option<Point2<f64>> {
        self.grows_up_to(point.coords.norm_squared()).then(|| self.polynomial(point))
    }

    /// The point at depth 1 that the lens maps to this position; `None` if no such point is found.
    pub fn undistort(&self, point: &Point2<f64>) -> Option<Point2<f64>> {
        if *self == Self::NONE {
            return Some(*point);
        }
        let mut found = *point;
        for _ in 0..MAX_STEPS {
            let off: Vector2<f64> = point - self.polynomial(&found);
            if off.norm() < TOLERANCE {
                return self.grows_up_to(found.coords.norm_squared()).then_some(found);
            }
            let step = self.jacobian(&found).try_inverse()? * off;
            // A step longer than 1 may lead beyond the radius at which the polynomial decreases again.
            found += step * (1.0 / step.norm()).min(1.0);
        }
        None
    }

    /// The polynomial's value at a point at depth 1, also beyond the radius at which it decreases again: an optimiser
    /// must be able to return from there.
    pub fn polynomial(&self, point: &Point2<f64>) -> Point2<f64> {
        let Self { p1, p2, .. } = *self;
        let (x, y, r2) = (point.x, point.y, point.coords.norm_squared());
        let radial = self.radial(r2);
        Point2::new(
            x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
            y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y,
        )
    }

    fn radial(&self, r2: f64) -> f64 {
        1.0 + r2 * (self.k1 + r2 * (self.k2 + r2 * self.k3))
    }

    /// The derivative of [`Self::polynomial`] by the point.
    pub fn jacobian(&self, point: &Point2<f64>) -> Matrix2<f64> {
        let Self { k1, k2, k3, p1, p2 } = *self;
        let (x, y, r2) = (point.x, point.y, point.coords.norm_squared());
        let radial = self.radial(r2);
        // Twice the derivative by r².
        let slope = 2.0 * (k1 + r2 * (2.0 * k2 + r2 * 3.0 * k3));
        let mixed = x * y * slope + 2.0 * p1 * x + 2.0 * p2 * y;
        Matrix2::new(
            radial + x * x * slope + 2.0 * p1 * y + 6.0 * p2 * x,
            mixed,
            mixed,
            radial + y * y * slope + 6.0 * p1 * y + 2.0 * p2 * x,
        )
    }

    /// Whether the distorted radius (radial terms only) increases with the radius, from the centre up to `√r2`.
    fn grows_up_to(&self, r2: f64) -> bool {
        // d(r radial)/dr is smallest where its derivative by r² is zero: 3 k1 + 10 k2 r² + 21 k3 r⁴ = 0.
        let growth = |t: f64| 1.0 + t * (3.0 * self.k1 + t * (5.0 * self.k2 + t * 7.0 * self.k3));
        let (a, b, c) = (21.0 * self.k3, 10.0 * self.k2, 3.0 * self.k1);
        let root = (b * b - 4.0 * a * c).sqrt();
        let extrema = if a == 0.0 { [-c / b, f64::NAN] } else { [(-b + root) / (2.0 * a), (-b - root) / (2.0 * a)] };
        growth(r2) > 0.0 && extrema.into_iter().filter(|t| (0.0..r2).contains(t)).all(|t| growth(t) > 0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_lens_that_turns_back_does_not_show_points_twice() {
        // r (1 − 0.4 r²) increases up to r = 0.91.
        let lens = PlumbBob { k1: -0.4, ..PlumbBob::NONE };
        assert!(lens.distort(&Point2::new(0.9, 0.0)).is_some());
        assert_eq!(lens.distort(&Point2::new(0.92, 0.0)), None);
        assert_eq!(lens.distort(&Point2::new(1.5, 0.0)), None);
        // 0.6086 is the largest radius in the distorted picture.
        assert!(lens.undistort(&Point2::new(0.6, 0.0)).is_some());
        assert_eq!(lens.undistort(&Point2::new(0.7, 0.0)), None);
        // The distorted radius decreases between 0.84 and 1.38 and then increases again: its derivative has two roots.
        let lens = PlumbBob { k1: -0.65, k2: 0.15, ..PlumbBob::NONE };
        assert_eq!(lens.distort(&Point2::new(2.5, 0.0)), None);
    }

    proptest! {
        #[test]
        fn undistorting_undoes_distorting(
            x in -0.8..0.8f64, y in -0.6..0.6f64, k1 in -0.3..0.3f64, k2 in -0.1..0.1f64, p1 in -0.01..0.01f64,
            p2 in -0.01..0.01f64, k3 in -0.05..0.05f64,
        ) {
            let lens = PlumbBob { k1, k2, p1, p2, k3 };
            let point = Point2::new(x, y);
            // Near the radius at which the polynomial decreases again, two points are so close together that either may
            // be found.
            if lens.grows_up_to(1.3 * point.coords.norm_squared()) && lens.jacobian(&point).determinant() > 0.2 {
                let back = lens.undistort(&lens.distort(&point).unwrap()).unwrap();
                prop_assert!((back - point).norm() < 1e-8, "{back} {point}");
            }
        }

        #[test]
        fn the_jacobian_is_the_polynomials(x in -0.8..0.8f64, y in -0.6..0.6f64) {
            let lens = PlumbBob { k1: -0.3, k2: 0.1, p1: 0.004, p2: -0.003, k3: -0.02 };
            let at = |dx: f64, dy: f64| lens.polynomial(&Point2::new(x + dx, y + dy));
            let h = 1e-6;
            let columns = [at(h, 0.0) - at(-h, 0.0), at(0.0, h) - at(0.0, -h)].map(|difference| difference / (2.0 * h));
            prop_assert!((Matrix2::from_columns(&columns) - lens.jacobian(&Point2::new(x, y))).norm() < 1e-7);
        }
    }
}
