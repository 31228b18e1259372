//! Rotation, scale and shift in the image plane: the pose of the demonstration in another image.

use nalgebra::{Point2, Vector2};
use serde::{Deserialize, Serialize};

use crate::Angle;

/// p' = scale · R(angle) · p + (tx, ty), in pixels with y down; never mirrored.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PlanarSimilarity {
    /// Scale factor, positive.
    pub scale: f64,
    /// Rotation; positive is clockwise, because y points down.
    pub angle: Angle,
    /// Shift to the right, in pixels.
    pub tx: f64,
    /// Shift down, in pixels.
    pub ty: f64,
}

impl PlanarSimilarity {
    /// The identity.
    pub const IDENTITY: Self = Self { scale: 1.0, angle: Angle::ZERO, tx: 0.0, ty: 0.0 };

    /// A shift by (tx, ty), in pixels.
    pub fn translation(tx: f64, ty: f64) -> Self {
        Self { tx, ty, ..Self::IDENTITY }
    }

    /// Rotates by `angle` and scales about `center`, then moves `center` to `target`.
    pub fn about(center: Point2<f64>, target: Point2<f64>, angle: Angle, scale: f64) -> Self {
        let mut made = Self { scale, angle, tx: 0.0, ty: 0.0 };
        let moved = made.apply(&center);
        made.tx = target.x - moved.x;
        made.ty = target.y - moved.y;
        made
    }

    /// The least-squares similarity that maps `from[i]` to `to[i]`; `None` if it is not unique, for example for fewer
    /// than two distinct points in `from` or in `to`.
    ///
    /// # Source
    /// Umeyama 1991; in two dimensions, complex numbers give the closed form.
    pub fn fit(from: &[Point2<f64>], to: &[Point2<f64>]) -> Option<Self> {
        assert_eq!(from.len(), to.len(), "points come in pairs");
        if from.len() < 2 {
            return None;
        }
        let n = from.len() as f64;
        let mean = |points: &[Point2<f64>]| points.iter().fold(Vector2::zeros(), |sum, p| sum + p.coords) / n;
        let (mean_from, mean_to) = (mean(from), mean(to));
        let (mut dot, mut cross, mut norm) = (0.0, 0.0, 0.0);
        for (a, b) in from.iter().zip(to) {
            let (a, b) = (a.coords - mean_from, b.coords - mean_to);
            dot += a.dot(&b);
            cross += a.perp(&b);
            norm += a.norm_squared();
        }
        let scale = dot.hypot(cross) / norm;
        if !(scale.is_finite() && scale > 0.0) {
            return None;
        }
        let angle = Angle::from_direction(dot, cross);
        Some(Self::about(Point2::from(mean_from), Point2::from(mean_to), angle, scale))
    }

    /// Transforms a point.
    pub fn apply(&self, point: &Point2<f64>) -> Point2<f64> {
        let (sin, cos) = self.angle.radians().sin_cos();
        Point2::new(
            self.scale * (cos * point.x - sin * point.y) + self.tx,
            self.scale * (sin * point.x + cos * point.y) + self.ty,
        )
    }

    /// `self`, followed by a shift of `by`, in pixels.
    pub fn shifted(&self, by: Vector2<f64>) -> Self {
        Self { tx: self.tx + by.x, ty: self.ty + by.y, ..*self }
    }

    /// `self` after `first`: `c_from_a = c_from_b.compose(b_from_a)`.
    pub fn compose(&self, first: &Self) -> Self {
        let shift = self.apply(&Point2::new(first.tx, first.ty));
        Self { scale: self.scale * first.scale, angle: self.angle + first.angle, tx: shift.x, ty: shift.y }
    }

    /// The inverse transform.
    pub fn inverse(&self) -> Self {
        let turn_back = Self { scale: 1.0 / self.scale, angle: -self.angle, tx: 0.0, ty: 0.0 };
        let shift = turn_back.apply(&Point2::new(self.tx, self.ty));
        Self { tx: -shift.x, ty: -shift.y, ..turn_back }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn any() -> impl Strategy<Value = PlanarSimilarity> {
        (0.2..4.0f64, -3.1..3.1f64, -100.0..100.0f64, -100.0..100.0f64)
            .prop_map(|(scale, angle, tx, ty)| PlanarSimilarity { scale, angle: Angle::from_radians(angle), tx, ty })
    }

    #[test]
    fn quarter_turn_sends_right_to_down() {
        let turn = PlanarSimilarity { angle: Angle::from_degrees(90.0), ..PlanarSimilarity::IDENTITY };
        let moved = turn.apply(&Point2::new(1.0, 0.0));
        assert!((moved - Point2::new(0.0, 1.0)).norm() < 1e-12);
    }

    proptest! {
        #[test]
        fn inverse_undoes(t in any(), x in -50.0..50.0f64, y in -50.0..50.0f64) {
            let p = Point2::new(x, y);
            prop_assert!((t.inverse().apply(&t.apply(&p)) - p).norm() < 1e-8);
            prop_assert!((t.compose(&t.inverse()).apply(&p) - p).norm() < 1e-8);
        }

        #[test]
        fn composition_is_one_after_the_other(a in any(), b in any(), x in -50.0..50.0f64, y in -50.0..50.0f64) {
            let p = Point2::new(x, y);
            prop_assert!((a.compose(&b).apply(&p) - a.apply(&b.apply(&p))).norm() < 1e-8);
        }

        #[test]
        fn shifts_come_last(t in any(), x in -50.0..50.0f64, y in -50.0..50.0f64) {
            let shift = PlanarSimilarity::translation(x, y);
            let p = Point2::new(3.0, -7.0);
            prop_assert!((t.shifted(Vector2::new(x, y)).apply(&p) - shift.compose(&t).apply(&p)).norm() < 1e-8);
        }

        #[test]
        fn fit_recovers_the_similarity(t in any()) {
            let from = [Point2::new(0.0, 0.0), Point2::new(10.0, 3.0), Point2::new(-4.0, 8.0)];
            let to = from.map(|p| t.apply(&p));
            let fitted = PlanarSimilarity::fit(&from, &to).unwrap();
            for p in from {
                prop_assert!((fitted.apply(&p) - t.apply(&p)).norm() < 1e-8);
            }
        }
    }
}
