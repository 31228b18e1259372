//! Maps between planes: a similarity with a slight tilt, as for an inclined camera.

use nalgebra::{Matrix3, Point2, Vector2};
use sdg_geometry::{BoundingBox, PlanarSimilarity};

/// A map between two image planes, `target_from_source`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Homography(Matrix3<f64>);

impl Homography {
    pub fn new(matrix: Matrix3<f64>) -> Self {
        Self(matrix)
    }

    pub fn scaling(factor: f64) -> Self {
        Self(Matrix3::new_nonuniform_scaling(&Vector2::new(factor, factor)))
    }

    pub fn translation(x: f64, y: f64) -> Self {
        Self(Matrix3::new_translation(&Vector2::new(x, y)))
    }

    pub fn from_similarity(similarity: &PlanarSimilarity) -> Self {
        let (sin, cos) = similarity.angle.radians().sin_cos();
        let (c, s) = (similarity.scale * cos, similarity.scale * sin);
        Self(Matrix3::new(c, -s, similarity.tx, s, c, similarity.ty, 0.0, 0.0, 1.0))
    }

    /// Foreshortening by the factor `1 - squeeze` along `direction`, with perspective: `perspective` is the relative
    /// change of scale per pixel along `direction`. Keeps the origin.
    pub fn tilt(direction: Vector2<f64>, squeeze: f64, perspective: f64) -> Self {
        let d = direction;
        Self(Matrix3::new(
            1.0 - squeeze * d.x * d.x,
            -squeeze * d.x * d.y,
            0.0,
            -squeeze * d.x * d.y,
            1.0 - squeeze * d.y * d.y,
            0.0,
            perspective * d.x,
            perspective * d.y,
            1.0,
        ))
    }

    /// c_from_a = c_from_b.compose(b_from_a).
    pub fn compose(&self, first: &Self) -> Self {
        Self(self.0 * first.0)
    }

    /// The inverse. Panics on a map that flattens the plane; no caller makes one.
    pub fn inverse(&self) -> Self {
        Self(self.0.try_inverse().expect("an augmentation never flattens the plane"))
    }

    pub fn apply(&self, point: &Point2<f64>) -> Point2<f64> {
        let p = self.0 * point.to_homogeneous();
        Point2::new(p.x / p.z, p.y / p.z)
    }

    pub fn bounds(&self, points: &[Point2<f64>]) -> Option<BoundingBox> {
        BoundingBox::around(points.iter().map(|point| self.apply(point)))
    }

    /// Positive if the map preserves orientation, negative if it mirrors.
    #[cfg(test)]
    pub fn handedness(&self, at: &Point2<f64>) -> f64 {
        let step = 1e-3;
        let p = self.apply(at);
        let x = self.apply(&Point2::new(at.x + step, at.y)) - p;
        let y = self.apply(&Point2::new(at.x, at.y + step)) - p;
        x.perp(&y) / (step * step)
    }

    /// The map along one row of pixel centres, in single precision.
    pub fn row(&self, y: usize) -> RowMap {
        let y = y as f64 + 0.5;
        let m = &self.0;
        let start = |k: usize| (m[(k, 0)] * 0.5 + m[(k, 1)] * y + m[(k, 2)]) as f32;
        RowMap { start: [start(0), start(1), start(2)], step: [m[(0, 0)] as f32, m[(1, 0)] as f32, m[(2, 0)] as f32] }
    }
}

/// See [`Homography::row`].
#[derive(Clone, Copy)]
pub(crate) struct RowMap {
    start: [f32; 3],
    step: [f32; 3],
}

impl RowMap {
    /// The position to which the map moves the centre of the pixel in column `x`.
    #[inline(always)]
    pub fn at(&self, x: usize) -> (f32, f32) {
        let x = x as f32;
        let w = 1.0 / (self.start[2] + self.step[2] * x);
        ((self.start[0] + self.step[0] * x) * w, (self.start[1] + self.step[1] * x) * w)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sdg_geometry::Angle;

    #[test]
    fn a_tilt_squeezes_along_its_direction_only() {
        let tilt = Homography::tilt(Vector2::new(1.0, 0.0), 0.2, 0.0);
        assert!((tilt.apply(&Point2::new(10.0, 10.0)) - Point2::new(8.0, 10.0)).norm() < 1e-12);
        let diagonal = Vector2::new(1.0, 1.0).normalize();
        let tilt = Homography::tilt(diagonal, 0.5, 0.0);
        assert!((tilt.apply(&Point2::new(2.0, 2.0)) - Point2::new(1.0, 1.0)).norm() < 1e-12);
        assert!((tilt.apply(&Point2::new(2.0, -2.0)) - Point2::new(2.0, -2.0)).norm() < 1e-12);
    }

    #[test]
    fn rows_agree_with_points() {
        let similarity = PlanarSimilarity { scale: 0.7, angle: Angle::from_degrees(33.0), tx: 40.0, ty: -3.0 };
        let map =
            Homography::from_similarity(&similarity).compose(&Homography::tilt(Vector2::new(0.6, 0.8), 0.1, 1e-4));
        let (x, y) = map.row(17).at(29);
        let exact = map.apply(&Point2::new(29.5, 17.5));
        assert!((f64::from(x) - exact.x).abs() < 1e-3 && (f64::from(y) - exact.y).abs() < 1e-3);
        assert!((map.inverse().apply(&exact) - Point2::new(29.5, 17.5)).norm() < 1e-9);
        assert!(map.handedness(&exact) > 0.0);
    }
}
