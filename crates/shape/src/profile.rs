//! The position of a part of revolution along its axis, and which end is which.
//!
//! In a roll angle (rotation about the axis) other than the photo's the threads are shifted along the part and its
//! light has changed, so that edges inside its outline shift a pose along the axis or turn it end for end. The profile
//! is the same in every roll.

use std::ops::RangeInclusive;

use image::RgbImage;
use nalgebra::{Point2, Vector2};
use sdg_geometry::{Angle, PlanarSimilarity, Polygon};

use crate::config::ShapeConfig;
use crate::following::Reach;
use crate::gradient_field::GradientField;
use crate::revolution::Revolution;
use crate::template::ShapeTemplate;

/// Number of shifts along the axis in each direction at which the profile is compared with the picture.
const NUM_SHIFTS: i32 = 4;
/// Step of the shifts along the axis, in part lengths; the largest shift exceeds a thread's pitch.
const SHIFT: f64 = 0.03;
/// Largest movement of a pose from its shifted start.
const REACH: Reach = Reach { shift_px: 4.0, turn_rad: 0.06, log_scale: 0.03 };
/// Minimum gain of the profile's agreement by a change of the pose, and largest loss of the agreement of all edges.
const MIN_GAIN: f64 = 0.05;
/// Number of steps into which a shift is divided. Chosen by hand: the largest shifts are of nine pixels.
const SHARES: usize = 8;

/// The edges along the outline of a part of revolution.
#[derive(Debug, Clone)]
pub(crate) struct Profile {
    template: ShapeTemplate,
    middle: Point2<f64>,
    /// Vector along the axis, as long as the part.
    axis: Vector2<f64>,
    pub(crate) revolution: Revolution,
}

impl Profile {
    /// `None` for other parts, and if the outline has too few edges.
    pub(crate) fn of(image: &RgbImage, outline: &Polygon, config: &ShapeConfig) -> Option<Self> {
        let revolution = Revolution::of(image, outline)?;
        let template = ShapeTemplate::of_outline(image, outline, config).ok()?;
        Some(Self { template, middle: outline.bounds().center(), axis: revolution.axis(), revolution })
    }

    /// The agreement of the edges along the outline at a pose, in `[0, 1]`.
    pub(crate) fn agreement(&self, field: &GradientField, pose: &PlanarSimilarity) -> f64 {
        self.template.agreement(field, pose)
    }

    /// The share of `shift`, in `[0, 1]`, by which the pose moves to the best agreement of the profile.
    pub(crate) fn share_of(&self, field: &GradientField, pose: &PlanarSimilarity, shift: Vector2<f64>) -> f64 {
        let share = |k: usize| k as f64 / SHARES as f64;
        let agreements: Vec<f64> =
            (0..=SHARES).map(|k| self.agreement(field, &pose.shifted(share(k) * shift))).collect();
        let best = (0..=SHARES).rev().max_by(|a, b| agreements[*a].total_cmp(&agreements[*b])).unwrap_or(0);
        if best == 0 || best == SHARES {
            return share(best);
        }
        // The vertex of the parabola through the best value and its neighbours.
        let [before, top, after] = [best - 1, best, best + 1].map(|k| agreements[k]);
        let curvature = before - 2.0 * top + after;
        let offset = if curvature < 0.0 { 0.5 * (before - after) / curvature } else { 0.0 };
        share(best) + offset / SHARES as f64
    }

    /// `pose`, or a pose shifted along the axis or turned end for end at which the profile agrees better. Scales stay
    /// in `scales`.
    ///
    /// The agreement of `all_edges` of the part may fall by at most [`MIN_GAIN`]: the edge of a hard shadow has the
    /// part's profile, but no edges inside it.
    pub(crate) fn placed(
        &self,
        field: &GradientField,
        all_edges: &ShapeTemplate,
        pose: &PlanarSimilarity,
        scales: &RangeInclusive<f64>,
    ) -> PlanarSimilarity {
        let half_turns = [0.0, std::f64::consts::PI];
        let starts = half_turns.into_iter().flat_map(|turn| {
            (-NUM_SHIFTS..=NUM_SHIFTS).map(move |k| {
                let to = self.middle + f64::from(k) * SHIFT * self.axis;
                PlanarSimilarity::about(self.middle, to, Angle::from_radians(turn), 1.0)
            })
        });
        let placed = starts
            .map(|start| self.template.snapped(field, &pose.compose(&start), &REACH))
            .filter(|placed| scales.contains(&placed.scale))
            .map(|placed| (placed, self.agreement(field, &placed)))
            .max_by(|a, b| a.1.total_cmp(&b.1));
        match placed {
            Some((placed, gained))
                if gained >= self.agreement(field, pose) + MIN_GAIN
                    && all_edges.agreement(field, &placed) >= all_edges.agreement(field, pose) - MIN_GAIN =>
            {
                placed
            }
            _ => *pose,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::Rgb;

    /// A bar with a thick head, lit as a round one, with a thread that `phase` moves along it.
    fn screw(phase: f64) -> (RgbImage, Polygon) {
        let profile = [[-60.0, 9.0], [30.0, 9.0], [30.0, 17.0], [60.0, 17.0]];
        let middle = Point2::new(120.0, 60.0);
        let side =
            |sign: f64| profile.into_iter().map(move |[along, radius]| middle + Vector2::new(along, sign * radius));
        let outline = Polygon { vertices: side(-1.0).chain(side(1.0).rev()).collect() };
        let color = |x: f64, y: f64| {
            let (along, across) = (x - middle.x, y - middle.y);
            let radius = if along < 30.0 { 9.0 } else { 17.0 };
            if along.abs() > 60.0 || across.abs() > radius {
                return 70.0;
            }
            let light = 0.5 + 0.5 * (1.0 - (across / radius - 0.3).powi(2)).max(0.0);
            let thread =
                if along < 30.0 && ((along - 0.4 * across - phase) / 14.0).rem_euclid(1.0) < 0.5 { 0.5 } else { 1.0 };
            230.0 * light * thread
        };
        let image = RgbImage::from_fn(240, 120, |x, y| {
            let samples = (0..16).map(|k| {
                let [right, down] = [k % 4, k / 4].map(|k| f64::from(k) / 4.0 + 0.125);
                color(f64::from(x) + right, f64::from(y) + down)
            });
            Rgb([(samples.sum::<f64>() / 16.0) as u8; 3])
        });
        (image, outline)
    }

    fn taught(photo: &RgbImage, outline: &Polygon) -> (Profile, ShapeTemplate) {
        let config = ShapeConfig::DEFAULT;
        (Profile::of(photo, outline, &config).unwrap(), ShapeTemplate::new(photo, outline, &config).unwrap())
    }

    #[test]
    fn a_pose_that_follows_the_thread_goes_back_to_the_ends() {
        let (photo, outline) = screw(0.0);
        let (profile, all_edges) = taught(&photo, &outline);
        let (rolled, _) = screw(7.0);
        let field = GradientField::new(&rolled);
        let moved = PlanarSimilarity { tx: 7.0, ..PlanarSimilarity::IDENTITY };
        let middle = profile.middle;
        let turned = PlanarSimilarity::about(middle, middle, Angle::from_radians(std::f64::consts::PI), 1.0);
        for start in [moved, turned.compose(&moved)] {
            let placed = profile.placed(&field, &all_edges, &start, &(0.8..=1.25));
            let off = (placed.apply(&middle) - middle).norm();
            assert!(off < 1.5 && placed.angle.radians().abs() < 0.05, "{start:?} → {placed:?}");
        }
    }

    #[test]
    fn the_share_of_a_shift_is_told_by_the_outline() {
        let (photo, outline) = screw(0.0);
        let profile = Profile::of(&photo, &outline, &ShapeConfig::DEFAULT).unwrap();
        let field = GradientField::new(&photo);
        let shift = Vector2::new(-2.0, 6.0);
        for share in [0.0, 0.3, 0.6, 1.0] {
            let pose = PlanarSimilarity::IDENTITY.shifted(-share * shift);
            let found = profile.share_of(&field, &pose, shift);
            assert!((found - share).abs() < 0.08, "{share}: {found}");
        }
        // If the shift leads away from the outline, the share is 0.
        assert_eq!(profile.share_of(&field, &PlanarSimilarity::IDENTITY.shifted(shift), shift), 0.0);
    }

    #[test]
    fn a_pose_that_fits_stays() {
        let (photo, outline) = screw(0.0);
        let (profile, all_edges) = taught(&photo, &outline);
        let field = GradientField::new(&photo);
        let placed = profile.placed(&field, &all_edges, &PlanarSimilarity::IDENTITY, &(0.8..=1.25));
        assert_eq!(placed, PlanarSimilarity::IDENTITY);
    }

    #[test]
    fn a_pose_does_not_go_to_the_shadow() {
        let (photo, outline) = screw(0.0);
        // The table is as bright as the part's sides, which therefore have no edges; the whole shadow is visible.
        let is_bright = |at: Point2<f64>| outline.contains(&Point2::new(at.x, 60.0 + (at.y - 60.0) / 0.6));
        let picture = |shadow: Vector2<f64>| {
            RgbImage::from_fn(photo.width(), photo.height(), |x, y| {
                let at = Point2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
                match (is_bright(at), outline.contains(&(at - shadow))) {
                    (true, _) => *photo.get_pixel(x, y),
                    (false, true) => Rgb([20; 3]),
                    (false, false) => Rgb([140; 3]),
                }
            })
        };
        let (profile, all_edges) = taught(&photo, &outline);
        let shadow = Vector2::new(-6.0, 2.0);
        let field = GradientField::new(&picture(shadow));
        let seen = |pose: &PlanarSimilarity| profile.agreement(&field, pose);
        let at_shadow = PlanarSimilarity::IDENTITY.shifted(shadow);
        assert!(seen(&at_shadow) > seen(&PlanarSimilarity::IDENTITY) + MIN_GAIN, "the shadow's outline agrees better");
        let placed = profile.placed(&field, &all_edges, &PlanarSimilarity::IDENTITY, &(0.8..=1.25));
        assert_eq!(placed, PlanarSimilarity::IDENTITY);
    }
}
