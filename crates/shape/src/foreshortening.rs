//! Foreshortening of a part compared with the photo, from the slant of an uncalibrated camera.
//!
//! A camera tilted by t from the vertical shows a flat part shortened by cos t in one direction of the image. Starting
//! from a pose (angle, shift and scale), an affine map with six coordinates is fitted to the part's edge points, by the
//! same consensus of crests as in [`crate::consensus`].

use nalgebra::{Matrix2, Point2, SVector, Vector2};
use sdg_geometry::{Angle, PlanarSimilarity};

use crate::consensus::{WIDTHS, consensus_at, fit_offsets};
use crate::edge_points::EdgePoint;
use crate::gradient_field::GradientField;
use crate::parallel;
use crate::pose::Pose;
use crate::sightings::{EdgePlace, FIRST_REACH, LATER_REACH, Sightings};
use crate::template::{MatchedLevel, ShapeTemplate, TemplateLevel};

/// Starts: no shortening, and each of these shortenings (ln of the ratio of lengths) in `NUM_DIRECTIONS` directions.
const START_LOG_RATIOS: [f64; 2] = [0.1, 0.22];
const NUM_DIRECTIONS: usize = 6;
/// Rounds of gathering crests anew. Chosen by hand to save time.
const ROUNDS: usize = 3;
/// ln of the shortening at the maximum tilt of the camera, 50°. Derived.
const MAX_LOG_RATIO: f64 = 0.45;

/// Largest edge movement by a shortening, as shift in x and in y (px), rotation (rad) and ln scale. Chosen by hand,
/// larger than any observed.
const READ_WITHIN: [f64; 4] = [24.0, 24.0, 0.0, 0.5];

/// The shortening of a part at a pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Foreshortening {
    /// ln of the length across the direction over the length along it, at least 0.
    pub log_ratio: f64,
    /// The direction of the image in which the part is shortened; its sign has no meaning.
    pub direction: Angle,
    /// The share of edge points on a crest of the image, in `[0, 1]`.
    pub consensus: f64,
    /// The share of edge points on a crest at the pose without shortening, in `[0, 1]`.
    pub level_consensus: f64,
}

/// An affine pose: `center` in image pixels, `linear` from demonstration pixels.
#[derive(Debug, Clone, Copy)]
struct Affine {
    center: Point2<f64>,
    linear: Matrix2<f64>,
}

impl ShapeTemplate {
    /// The shortening of the part near `start`; `None` if the pose has no inverse, or if the part is shortened more
    /// than at the maximum tilt.
    ///
    /// # Units and frames
    /// The pose maps demonstration pixels to pixels of the image the field was computed from.
    pub fn foreshortening(&self, field: &GradientField, start: &PlanarSimilarity) -> Option<Foreshortening> {
        let pose = Pose::from_similarity(start, self.center);
        let level = &self.levels[self.agreement_level_idx];
        let matched = level.matched_level(field, &pose, READ_WITHIN);
        let (sin, cos) = pose.angle_rad.sin_cos();
        let linear = start.scale * Matrix2::new(cos, -sin, sin, cos);
        let upright = Affine { center: pose.center, linear };
        let level_consensus = consensus(level, &matched, &upright)?;
        let mut best: Option<(Affine, f64)> = None;
        let starts: Vec<Matrix2<f64>> = starts().collect();
        let all = parallel::map(&starts, |start| follow(level, &matched, Affine { linear: start * linear, ..upright }));
        for followed in all {
            if let Some((affine, found)) = followed
                && best.is_none_or(|(_, before)| found > before)
            {
                best = Some((affine, found));
            }
        }
        let (affine, consensus) = best?;
        let svd = affine.linear.svd_unordered(true, false);
        let (u, lengths) = (svd.u?, svd.singular_values);
        let (long, short) = if lengths[0] >= lengths[1] { (0, 1) } else { (1, 0) };
        let log_ratio = (lengths[long] / lengths[short]).ln();
        let direction = u.column(short);
        (log_ratio <= MAX_LOG_RATIO).then(|| Foreshortening {
            log_ratio,
            direction: Angle::from_direction(direction.x, direction.y),
            consensus,
            level_consensus,
        })
    }
}

/// The identity, and maps of the image that shorten it in one direction and keep its area.
fn starts() -> impl Iterator<Item = Matrix2<f64>> {
    let shortened = START_LOG_RATIOS.into_iter().flat_map(|log_ratio| {
        (0..NUM_DIRECTIONS).map(move |k| {
            let (sin, cos) = (k as f64 * std::f64::consts::PI / NUM_DIRECTIONS as f64).sin_cos();
            let along = Vector2::new(cos, sin);
            let factor = (-0.5 * log_ratio).exp();
            let across = Vector2::new(-sin, cos);
            factor * along * along.transpose() + across * across.transpose() / factor
        })
    });
    std::iter::once(Matrix2::identity()).chain(shortened)
}

fn consensus(level: &TemplateLevel, matched: &MatchedLevel<'_>, pose: &Affine) -> Option<f64> {
    let sightings = gather(level, matched, pose, LATER_REACH)?;
    Some(consensus_at(&sightings, &SVector::zeros()))
}

/// Moves a pose onto the crests nearby; returns the pose and its consensus.
fn follow(level: &TemplateLevel, matched: &MatchedLevel<'_>, mut pose: Affine) -> Option<(Affine, f64)> {
    let pixel = matched.image_pixel_size;
    let mut score = 0.0;
    for round in 0..ROUNDS {
        let (reach, widths) = if round == 0 { (FIRST_REACH, &WIDTHS[..]) } else { (LATER_REACH, &WIDTHS[1..]) };
        let sightings = gather(level, matched, &pose, reach)?;
        let step = fit_offsets(&sightings, [true; 6], SVector::zeros(), widths);
        let found = consensus_at(&sightings, &step);
        let per_radius = Matrix2::new(step[2], step[3], step[4], step[5]) / radius(level, pixel, &pose);
        pose.center += pixel * Vector2::new(step[0], step[1]);
        pose.linear = (Matrix2::identity() + per_radius) * pose.linear;
        score = found;
    }
    Some((pose, score))
}

/// The template's radius at a pose, in level pixels.
fn radius(level: &TemplateLevel, image_pixel_size: f64, pose: &Affine) -> f64 {
    (level.radius_px * pose.linear.determinant().abs().sqrt() / image_pixel_size).max(1.0)
}

/// The crests of the edge points at an affine pose; `None` if the pose has no inverse.
fn gather(level: &TemplateLevel, matched: &MatchedLevel<'_>, pose: &Affine, reach: usize) -> Option<Sightings<6>> {
    let pixel = matched.image_pixel_size;
    let normal_map = pose.linear.try_inverse()?.transpose();
    let radius = radius(level, pixel, pose);
    let place = |point: &EdgePoint| {
        let [offset, normal] = [point.offset, point.normal].map(|v| Vector2::new(f64::from(v[0]), f64::from(v[1])));
        let from_center = pose.linear * offset / pixel;
        let n = (normal_map * normal).try_normalize(f64::EPSILON)?;
        let r = from_center / radius;
        let at = pose.center.coords / pixel + from_center;
        Some(EdgePlace {
            at: [at.x as f32, at.y as f32],
            normal: [n.x as f32, n.y as f32],
            double: [(n.x * n.x - n.y * n.y) as f32, (2.0 * n.x * n.y) as f32],
            row: [n.x, n.y, n.x * r.x, n.x * r.y, n.y * r.x, n.y * r.y].map(|value| value as f32),
            weight: point.weight,
        })
    };
    let places = level.points.iter().map(place).collect::<Option<Vec<EdgePlace<6>>>>()?;
    Some(Sightings::gather(matched.image_level, &places, reach))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::ShapeConfig;
    use image::{Rgb, RgbImage};
    use sdg_geometry::{BoundingBox, Polygon};

    const MIDDLE: Point2<f64> = Point2::new(120.0, 100.0);

    /// A dark plate of 100 × 60 pixels with a hole, shortened by a factor in a direction of the image.
    fn plate(factor: f64, direction_deg: f64) -> RgbImage {
        let (sin, cos) = direction_deg.to_radians().sin_cos();
        RgbImage::from_fn(240, 200, |x, y| {
            let samples = (0..16).map(|k| {
                let [right, down] = [k % 4, k / 4].map(|k| f64::from(k) / 4.0 + 0.125);
                let from = Vector2::new(f64::from(x) + right, f64::from(y) + down) - MIDDLE.coords;
                let along = cos * from.x + sin * from.y;
                let level = from + (along / factor - along) * Vector2::new(cos, sin);
                let on_plate =
                    level.x.abs() < 50.0 && level.y.abs() < 30.0 && (level.x - 30.0).hypot(level.y - 8.0) > 9.0;
                if on_plate { 60.0 } else { 200.0 }
            });
            Rgb([(samples.sum::<f64>() / 16.0) as u8; 3])
        })
    }

    #[test]
    fn a_plate_seen_at_a_slant_is_shortened_where_and_as_much_as_it_is() {
        let outline = Polygon::from_box(&BoundingBox { x1: 70.0, y1: 70.0, x2: 170.0, y2: 130.0 });
        let template = ShapeTemplate::new(&plate(1.0, 0.0), &outline, &ShapeConfig::DEFAULT).unwrap();
        let seen = |factor: f64, direction_deg: f64| {
            let field = GradientField::new(&plate(factor, direction_deg));
            template.foreshortening(&field, &PlanarSimilarity::IDENTITY).unwrap()
        };
        assert!(seen(1.0, 0.0).log_ratio < 0.01);
        for (factor, direction_deg) in [(0.94, 30.0), (0.87, 100.0), (0.82, 0.0)] {
            let found = seen(factor, direction_deg);
            let off_deg =
                (2.0 * (found.direction.degrees() - direction_deg)).to_radians().sin().asin().to_degrees() / 2.0;
            assert!((found.log_ratio + factor.ln()).abs() < 0.02 && off_deg.abs() < 5.0, "{factor}: {found:?}");
            assert!(found.consensus > found.level_consensus + 0.05, "{found:?}");
        }
    }
}
