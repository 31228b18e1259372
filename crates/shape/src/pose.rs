//! A pose of the template during refinement, given about the part's centre, which rotation and scaling do not move.

use nalgebra::Point2;
use sdg_geometry::{Angle, PlanarSimilarity};

/// The position of the part's centre in the image, the part's angle and its scale.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Pose {
    /// In image pixels.
    pub(crate) center: Point2<f64>,
    pub(crate) angle_rad: f64,
    pub(crate) log_scale: f64,
}

impl Pose {
    pub(crate) fn from_similarity(image_from_demonstration: &PlanarSimilarity, pivot: Point2<f64>) -> Self {
        Self {
            center: image_from_demonstration.apply(&pivot),
            angle_rad: image_from_demonstration.angle.radians(),
            log_scale: image_from_demonstration.scale.ln(),
        }
    }

    pub(crate) fn to_similarity(self, pivot: Point2<f64>) -> PlanarSimilarity {
        PlanarSimilarity::about(pivot, self.center, Angle::from_radians(self.angle_rad), self.log_scale.exp())
    }

    /// Moved by (x px, y px, angle rad, ln scale).
    pub(crate) fn moved(self, step: [f64; 4]) -> Self {
        Self {
            center: Point2::new(self.center.x + step[0], self.center.y + step[1]),
            angle_rad: self.angle_rad + step[2],
            log_scale: self.log_scale + step[3],
        }
    }

    /// Whether every coordinate (x, y, angle, ln scale) differs by less than its unit.
    pub(crate) fn is_near(&self, other: &Self, units: [f64; 4]) -> bool {
        (self.center.x - other.center.x).abs() < units[0]
            && (self.center.y - other.center.y).abs() < units[1]
            && (self.angle_rad - other.angle_rad).abs() < units[2]
            && (self.log_scale - other.log_scale).abs() < units[3]
    }

    /// The map to a pyramid level whose pixel is `image_pixel_size` image pixels.
    pub(crate) fn level_map(&self, image_pixel_size: f64) -> LevelMap {
        let (sin, cos) = self.angle_rad.sin_cos();
        let factor = self.log_scale.exp() / image_pixel_size;
        let (double_sin, double_cos) = (2.0 * self.angle_rad).sin_cos();
        LevelMap {
            a: (factor * cos) as f32,
            b: (factor * sin) as f32,
            tx: (self.center.x / image_pixel_size) as f32,
            ty: (self.center.y / image_pixel_size) as f32,
            turn: [cos as f32, sin as f32],
            double_turn: [double_cos as f32, double_sin as f32],
        }
    }
}

/// The map from offsets about the part's centre (demonstration pixels) to level pixels, in single precision.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LevelMap {
    a: f32,
    b: f32,
    tx: f32,
    ty: f32,
    turn: [f32; 2],
    double_turn: [f32; 2],
}

impl LevelMap {
    #[inline]
    pub(crate) fn apply(&self, [x, y]: [f32; 2]) -> [f32; 2] {
        [self.a * x - self.b * y + self.tx, self.b * x + self.a * y + self.ty]
    }

    /// [`Self::apply`] for many places.
    #[inline(always)]
    pub(crate) fn apply_all<const N: usize>(&self, x: &[f32; N], y: &[f32; N]) -> [[f32; N]; 2] {
        [
            std::array::from_fn(|k| self.a * x[k] - self.b * y[k] + self.tx),
            std::array::from_fn(|k| self.b * x[k] + self.a * y[k] + self.ty),
        ]
    }

    /// (cos, sin) of twice the angle.
    pub(crate) fn double_turn(&self) -> [f32; 2] {
        self.double_turn
    }

    /// Rotates a direction.
    #[inline]
    pub(crate) fn turn(&self, v: [f32; 2]) -> [f32; 2] {
        turned(v, self.turn)
    }

    /// Rotates a direction given at twice its angle.
    #[inline]
    pub(crate) fn turn_double(&self, v: [f32; 2]) -> [f32; 2] {
        turned(v, self.double_turn)
    }
}

#[inline]
fn turned([x, y]: [f32; 2], [cos, sin]: [f32; 2]) -> [f32; 2] {
    [cos * x - sin * y, sin * x + cos * y]
}
