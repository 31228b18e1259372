//! A table viewed at a slant, and the picture that a camera vertically above it would have taken.

use nalgebra::{Matrix2, Point2, Vector2};
use serde::{Deserialize, Serialize};

use crate::Angle;

/// The view of the table by an uncalibrated camera, with an assumed lens. At the centre of the picture, lengths across
/// the slant equal those of the level picture.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Slant {
    /// Angle between the camera's axis and the table's normal, in radians, from 0 to less than π/2.
    pub tilt_rad: f64,
    /// The direction in the picture in which the table recedes.
    pub away: Angle,
    /// Focal length, in pixels of the picture.
    pub focal_px: f64,
}

impl Slant {
    /// The view from vertically above.
    pub fn level(focal_px: f64) -> Self {
        Self { tilt_rad: 0.0, away: Angle::ZERO, focal_px }
    }

    /// The position in the slanted picture of a point of the level picture; both relative to the picture's centre.
    /// `None` behind the camera or close to its plane.
    pub fn picture_from_level(&self, level: Vector2<f64>) -> Option<Vector2<f64>> {
        let [away, aside] = self.axes();
        let (sin, cos) = self.tilt_rad.sin_cos();
        let depth = 1.0 + level.dot(&away) * sin / self.focal_px;
        (depth > MIN_DEPTH).then(|| (level.dot(&away) * cos * away + level.dot(&aside) * aside) / depth)
    }

    /// The point of the level picture at a position of the slanted picture; both relative to the picture's centre.
    /// `None` near the horizon and beyond it.
    pub fn level_from_picture(&self, seen: Vector2<f64>) -> Option<Vector2<f64>> {
        let [away, aside] = self.axes();
        let (sin, cos) = self.tilt_rad.sin_cos();
        let nearness = cos - seen.dot(&away) * sin / self.focal_px;
        if nearness <= MIN_DEPTH {
            return None;
        }
        let along = seen.dot(&away) / nearness;
        let depth = 1.0 + along * sin / self.focal_px;
        Some(along * away + seen.dot(&aside) * depth * aside)
    }

    /// The point of the level picture vertically below the camera, relative to the picture's centre.
    pub fn below_camera(&self) -> Point2<f64> {
        Point2::from(-self.focal_px * self.tilt_rad.sin() * self.axes()[0])
    }

    /// The height of the camera above the table, in pixels of the level picture.
    pub fn camera_height_px(&self) -> f64 {
        self.focal_px * self.tilt_rad.cos()
    }

    /// The foreshortening at a position of the picture. A short line of fixed length on the table has different lengths
    /// in the picture, depending on its direction. The result is the natural logarithm of the ratio of the longest to
    /// the shortest of these lengths, and the direction of the shortest in the picture. `None` as for
    /// [`Self::level_from_picture`].
    pub fn shortening_at(&self, seen: Vector2<f64>) -> Option<(f64, Angle)> {
        const STEP_PX: f64 = 0.5;
        let level = self.level_from_picture(seen)?;
        let side = |step: Vector2<f64>| {
            Some((self.picture_from_level(level + step)? - self.picture_from_level(level - step)?) / (2.0 * STEP_PX))
        };
        let jacobian = Matrix2::from_columns(&[side(STEP_PX * Vector2::x())?, side(STEP_PX * Vector2::y())?]);
        // Axes of the ellipse onto which a small circle is mapped: lengths and directions.
        let ellipse = jacobian * jacobian.transpose();
        let (difference, cross) = (ellipse[(0, 0)] - ellipse[(1, 1)], 2.0 * ellipse[(0, 1)]);
        let (mean, radius) = (0.5 * ellipse.trace(), 0.5 * difference.hypot(cross));
        let long = Angle::from_radians(0.5 * cross.atan2(difference));
        let log_ratio = 0.5 * ((mean + radius) / (mean - radius).max(f64::MIN_POSITIVE)).ln();
        Some((log_ratio, long + Angle::from_degrees(90.0)))
    }

    fn axes(&self) -> [Vector2<f64>; 2] {
        let (sin, cos) = self.away.radians().sin_cos();
        [Vector2::new(cos, sin), Vector2::new(-sin, cos)]
    }
}

/// Minimum relative depth. Points closer to the camera's plane, or to the horizon, give `None`.
const MIN_DEPTH: f64 = 0.1;

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;

    const SLANT: Slant = Slant { tilt_rad: 0.5, away: Angle::ZERO, focal_px: 700.0 };

    #[test]
    fn there_and_back() {
        for (degrees, x, y) in [(0.0, 30.0, 40.0), (75.0, -200.0, 90.0), (210.0, 250.0, -180.0)] {
            let slant = Slant { away: Angle::from_degrees(degrees), ..SLANT };
            let level = Vector2::new(x, y);
            let back = slant.level_from_picture(slant.picture_from_level(level).unwrap()).unwrap();
            assert!((back - level).norm() < 1e-9, "{back}");
        }
    }

    #[test]
    fn a_raised_point_appears_away_from_the_point_below_the_camera() {
        // The camera's axis and the axes of its picture, in directions away, aside and up, all in pixels of the level
        // picture.
        let (sin, cos) = SLANT.tilt_rad.sin_cos();
        let (axis, away) = (Vector3::new(sin, 0.0, -cos), Vector3::new(cos, 0.0, sin));
        let (foot, camera_height) = (SLANT.below_camera(), SLANT.camera_height_px());
        for (level, height) in [(Vector2::new(120.0, -80.0), 15.0), (Vector2::new(-200.0, 60.0), 40.0)] {
            let from_camera = Vector3::new(level.x - foot.x, level.y - foot.y, height - camera_height);
            let seen = SLANT.focal_px / from_camera.dot(&axis) * Vector2::new(from_camera.dot(&away), from_camera.y);
            let shift = SLANT.level_from_picture(seen).unwrap() - level;
            let expected = height / (camera_height - height) * (level - foot.coords);
            assert!((shift - expected).norm() < 1e-9, "{shift}");
        }
    }

    #[test]
    fn shortening_is_that_of_the_tilt_in_the_middle_and_more_where_the_table_recedes() {
        let (log_ratio, direction) = SLANT.shortening_at(Vector2::zeros()).unwrap();
        assert!((log_ratio + 0.5f64.cos().ln()).abs() < 1e-4 && direction.radians().sin().abs() < 1e-3);
        let at = |x: f64| SLANT.shortening_at(Vector2::new(x, 0.0)).unwrap().0;
        assert!(at(200.0) > log_ratio + 0.05 && at(-200.0) < log_ratio - 0.05);
    }

    #[test]
    fn what_recedes_is_shortened_and_small_and_the_horizon_is_refused() {
        let seen = |x: f64, y: f64| SLANT.picture_from_level(Vector2::new(x, y)).unwrap();
        let along = (seen(1.0, 0.0) - seen(-1.0, 0.0)).norm() / 2.0;
        assert!((along - 0.5f64.cos()).abs() < 1e-4);
        assert!((seen(0.0, 1.0).norm() - 1.0).abs() < 1e-9);
        assert!(seen(200.0, 1.0).y < 1.0 && seen(-200.0, 1.0).y > 1.0);
        assert_eq!(SLANT.level_from_picture(Vector2::new(700.0 / 0.5f64.tan(), 0.0)), None);
    }
}
