//! The limits of a refinement, and the units of its steps.

use crate::gradient_field::GradientField;
use crate::pose::Pose;
use crate::template::{MatchedLevel, ShapeTemplate, TemplateLevel};

/// Maximum change of x and y, in pixels: that of a picture of 2,000 pixels. The time grows with its square, and in larger
/// pictures, where the part is small, errors of an initial pose are no larger. Chosen by hand.
const MAX_SHIFT_PX: f64 = 40.0;

/// The limits of a refinement: a box around the initial pose.
pub(crate) struct CaptureRange {
    pub(crate) start: Pose,
    /// Largest change of x (px), y (px), angle (rad), ln scale.
    pub(crate) limits: [f64; 4],
}

impl CaptureRange {
    pub(crate) fn new(template: &ShapeTemplate, field: &GradientField, start: Pose) -> Self {
        let config = &template.config;
        let shift = (config.capture_shift * field.width() as f64).min(MAX_SHIFT_PX);
        Self { start, limits: [shift, shift, config.capture_angle_rad, config.scale.max_log()] }
    }

    /// A box about `start` that reaches `limits` (px, px, rad, ln scale) in both directions.
    pub(crate) fn around(start: Pose, limits: [f64; 4]) -> Self {
        Self { start, limits }
    }

    /// The pyramid level of the picture that a template level is compared with at all poses of the range.
    pub(crate) fn matched_level<'a>(&self, level: &TemplateLevel, field: &'a GradientField) -> MatchedLevel<'a> {
        level.matched_level(field, &self.start, self.limits)
    }

    pub(crate) fn pose_at_cell(&self, cell: [i32; 4], counts: [i32; 4]) -> Pose {
        let step = [0, 1, 2, 3].map(|k| self.limits[k] * f64::from(cell[k]) / f64::from(counts[k].max(1)));
        self.start.moved(step)
    }

    fn difference(&self, pose: &Pose) -> [f64; 4] {
        [
            pose.center.x - self.start.center.x,
            pose.center.y - self.start.center.y,
            pose.angle_rad - self.start.angle_rad,
            pose.log_scale - self.start.log_scale,
        ]
    }

    /// Mean over the four coordinates of `(change from the start / its limit)²`, in `[0, 1]`.
    pub(crate) fn distance(&self, pose: &Pose) -> f64 {
        let difference = self.difference(pose);
        (0..4).filter(|&k| self.limits[k] > 0.0).map(|k| (difference[k] / self.limits[k]).powi(2)).sum::<f64>() / 4.0
    }

    pub(crate) fn clamped(&self, pose: &Pose) -> Pose {
        let difference = self.difference(pose);
        self.start.moved([0, 1, 2, 3].map(|k| difference[k].clamp(-self.limits[k], self.limits[k])))
    }
}

/// Changes of (x, y, angle, ln scale) that each move the edges by about one pixel of the image level.
pub(crate) fn step_units(level: &TemplateLevel, matched: &MatchedLevel<'_>, pose: &Pose) -> [f64; 4] {
    let pixel = matched.image_pixel_size;
    let turn = pixel / (level.radius_px * pose.log_scale.exp()).max(1.0);
    [pixel, pixel, turn, turn]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ShapeConfig;
    use image::{Rgb, RgbImage};
    use nalgebra::Point2;
    use sdg_geometry::{BoundingBox, PlanarSimilarity, Polygon};

    #[test]
    fn a_wide_picture_is_searched_no_further_than_one_of_2000_pixels() {
        let part = BoundingBox { x1: 20.0, y1: 20.0, x2: 80.0, y2: 60.0 };
        let picture = |width: u32| {
            let is_part = |x: u32, y: u32| (20..80).contains(&x) && (20..60).contains(&y);
            RgbImage::from_fn(width, 80, |x, y| Rgb([if is_part(x, y) { 40 } else { 200 }; 3]))
        };
        let template = ShapeTemplate::new(&picture(100), &Polygon::from_box(&part), &ShapeConfig::DEFAULT).unwrap();
        let start = Pose::from_similarity(&PlanarSimilarity::IDENTITY, Point2::new(50.0, 40.0));
        let shift = |width: u32| CaptureRange::new(&template, &GradientField::new(&picture(width)), start).limits[0];
        assert_eq!([500, 2000, 4000].map(shift), [10.0, 40.0, 40.0]);
    }
}
