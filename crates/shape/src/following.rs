//! Moves a pose that was right in the last picture of a sequence onto the edges of the next.
//!
//! ```text
//! start ─ a few pixels off ─ snapped: the agreement's level, then the finest ─ pose
//!       ─ further off ────── captured: every level climbed and snapped ─────── pose
//! ```
//! Refinement of a single picture ([`ShapeTemplate::refine`]) starts from a grid of poses over its capture range. In a
//! sequence the last pose and its velocity give a start with an error of about a pixel, so no grid is needed.

use sdg_geometry::PlanarSimilarity;

use crate::capture_range::CaptureRange;
use crate::consensus::{Starts, snap_from};
use crate::gradient_field::GradientField;
use crate::pose::Pose;
use crate::template::ShapeTemplate;

/// Largest movement of a pose from its start.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reach {
    /// In x and in y, in pixels of the image.
    pub shift_px: f64,
    /// Rotation in either direction, in radians.
    pub turn_rad: f64,
    /// Change of ln scale in either direction; 0 keeps the scale.
    pub log_scale: f64,
}

impl Reach {
    fn about(&self, start: Pose) -> CaptureRange {
        CaptureRange::around(start, [self.shift_px, self.shift_px, self.turn_rad, self.log_scale])
    }
}

impl ShapeTemplate {
    /// Image pixels per pixel of the coarsest level of refinement, for a part `scale` times as large as in the
    /// demonstration. An image window whose corner is at multiples of this value has the same pyramid as the image.
    pub fn coarsest_pixel(&self, scale: f64) -> u32 {
        let pixel_size = self.levels[self.levels.len() - 1].pixel_size * scale;
        1 << pixel_size.max(1.0).log2().round() as u32
    }

    /// Moves a pose onto the edges. The start's error may be at most about six pixels of the level at which agreement
    /// is computed (for a part of 128 pixels, twelve image pixels). Deterministic.
    ///
    /// # Units and frames
    /// Poses map demonstration pixels to pixels of the image the field was computed from.
    pub fn snapped(&self, field: &GradientField, start: &PlanarSimilarity, reach: &Reach) -> PlanarSimilarity {
        let start = Pose::from_similarity(start, self.center);
        let range = reach.about(start);
        let coarse = &self.levels[self.agreement_level_idx];
        let mut pose = snap_from(coarse, &range.matched_level(coarse, field), &range, start, Starts::Around).pose;
        if self.agreement_level_idx > 0 {
            let finest = &self.levels[0];
            pose = snap_from(finest, &range.matched_level(finest, field), &range, pose, Starts::Here).pose;
        }
        pose.to_similarity(self.center)
    }

    /// As [`Self::captured`] at the coarsest level only; returns the pose and its agreement there.
    pub(crate) fn captured_coarsely(
        &self,
        field: &GradientField,
        start: &PlanarSimilarity,
        reach: &Reach,
    ) -> (PlanarSimilarity, f64) {
        let start = Pose::from_similarity(start, self.center);
        let (pose, agreement) = self.climb_coarsest(field, &reach.about(start), start);
        (pose.to_similarity(self.center), agreement)
    }

    /// As [`Self::captured`] down to the agreement's level, with the agreement there: for a pose that is compared but
    /// not grasped.
    pub(crate) fn captured_roughly(
        &self,
        field: &GradientField,
        start: &PlanarSimilarity,
        reach: &Reach,
    ) -> (PlanarSimilarity, f64) {
        let start = Pose::from_similarity(start, self.center);
        let pose = self.follow_roughly(field, &reach.about(start), start);
        (pose.to_similarity(self.center), self.agreement_at(field, &pose))
    }

    /// Moves a pose with a larger error onto the edges: climbs and snaps at every level, about five times slower than
    /// [`Self::snapped`]. Deterministic.
    ///
    /// # Units and frames
    /// As for [`Self::snapped`].
    pub fn captured(&self, field: &GradientField, start: &PlanarSimilarity, reach: &Reach) -> PlanarSimilarity {
        let start = Pose::from_similarity(start, self.center);
        self.follow(field, &reach.about(start), start).to_similarity(self.center)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::ShapeConfig;
    use image::{Rgb, RgbImage};
    use nalgebra::Point2;
    use sdg_geometry::{Angle, BoundingBox, Polygon};

    /// A dark plate of 100 × 60 pixels with a bright hole off its middle, turned about its middle, which lies at
    /// `middle`.
    fn plate(angle_deg: f64, middle: Point2<f64>) -> RgbImage {
        let (sin, cos) = angle_deg.to_radians().sin_cos();
        RgbImage::from_fn(240, 200, |x, y| {
            // 4 × 4 samples per pixel smooth the edges, as a lens does.
            let mut sum = 0.0;
            for k in 0..16 {
                let (right, down) = (f64::from(k % 4) / 4.0 + 0.125, f64::from(k / 4) / 4.0 + 0.125);
                let (dx, dy) = (f64::from(x) + right - middle.x, f64::from(y) + down - middle.y);
                let (u, v) = (cos * dx + sin * dy, cos * dy - sin * dx);
                let on_plate = u.abs() < 50.0 && v.abs() < 30.0 && (u - 30.0).hypot(v - 8.0) > 9.0;
                sum += if on_plate { 60.0 } else { 200.0 };
            }
            Rgb([(sum / 16.0) as u8; 3])
        })
    }

    const MIDDLE: Point2<f64> = Point2::new(120.0, 100.0);

    fn template() -> ShapeTemplate {
        let outline = Polygon::from_box(&BoundingBox { x1: 70.0, y1: 70.0, x2: 170.0, y2: 130.0 });
        ShapeTemplate::new(&plate(0.0, MIDDLE), &outline, &ShapeConfig::DEFAULT).unwrap()
    }

    fn error(pose: &PlanarSimilarity, angle_deg: f64, middle: Point2<f64>) -> (f64, f64) {
        ((pose.apply(&MIDDLE) - middle).norm(), pose.angle.distance(Angle::from_degrees(angle_deg)).to_degrees())
    }

    /// The crest of a sampled edge is found by a parabola, with an error of up to a seventh of a pixel.
    const MAX_OFF_PX: f64 = 0.2;
    const MAX_OFF_DEG: f64 = 0.15;
    const REACH: Reach = Reach { shift_px: 16.0, turn_rad: 0.2, log_scale: 0.02 };

    #[test]
    fn a_start_some_pixels_off_is_snapped_to_a_fifth_of_a_pixel() {
        let template = template();
        for (angle_deg, dx, dy) in [(0.0, 1.3, 0.4), (2.0, -3.0, 2.0), (-3.0, 4.0, -4.0)] {
            let middle = MIDDLE + nalgebra::Vector2::new(dx, dy);
            let field = GradientField::new(&plate(angle_deg, middle));
            let pose = template.snapped(&field, &PlanarSimilarity::IDENTITY, &REACH);
            let (off_px, off_deg) = error(&pose, angle_deg, middle);
            assert!(off_px < MAX_OFF_PX && off_deg < MAX_OFF_DEG, "{angle_deg} {dx} {dy}: {off_px} px, {off_deg}°");
        }
    }

    #[test]
    fn a_start_further_off_is_captured_and_the_reach_is_kept() {
        let (template, middle) = (template(), MIDDLE + nalgebra::Vector2::new(10.0, -9.0));
        let field = GradientField::new(&plate(7.0, middle));
        let pose = template.captured(&field, &PlanarSimilarity::IDENTITY, &REACH);
        let (off_px, off_deg) = error(&pose, 7.0, middle);
        assert!(off_px < MAX_OFF_PX && off_deg < MAX_OFF_DEG, "{off_px} px, {off_deg}°");
        let near = Reach { shift_px: 3.0, ..REACH };
        let start = PlanarSimilarity::IDENTITY;
        for pose in [template.captured(&field, &start, &near), template.snapped(&field, &start, &near)] {
            let shift = pose.apply(&MIDDLE) - MIDDLE;
            assert!(shift.amax() <= 3.0 + 1e-9, "{shift}");
        }
    }

    #[test]
    fn a_window_at_multiples_of_the_coarsest_pixel_gives_the_same_pose_as_the_image() {
        let template = template();
        let image = plate(3.0, MIDDLE + nalgebra::Vector2::new(2.0, 1.0));
        let step = template.coarsest_pixel(1.0);
        assert_eq!(step, 2);
        let (left, top) = (step * 20, step * 24);
        let window = image::imageops::crop_imm(&image, left, top, 160, 120).to_image();
        let whole = template.snapped(&GradientField::new(&image), &PlanarSimilarity::IDENTITY, &REACH);
        let shifted = PlanarSimilarity::translation(-f64::from(left), -f64::from(top));
        let pose = template.snapped(&GradientField::new(&window), &shifted, &REACH);
        let apart =
            pose.apply(&MIDDLE) + nalgebra::Vector2::new(f64::from(left), f64::from(top)) - whole.apply(&MIDDLE);
        assert!(apart.norm() < 0.01, "{apart}");
    }
}
