//! The height of the compared edges above the plane of the marks, measured with further photos of a calibrated camera.
//!
//! A detection lays the edges of one photo over another picture. Edges higher than the marks appear displaced away from
//! the camera, by their height times the tangent of the line of sight's angle from the vertical:
//! ```text
//! grasp according to the edges − marked grasp = edge height · (slant of the picture − slant of the photo, rotated)
//! ```
//! Each pair of photos that show the part from different sides gives such an equation.

use std::collections::BTreeSet;

use nalgebra::Vector2;
use sdg_demonstration::Demonstration;
use sdg_geometry::{Angle, GraspLine, PlanarSimilarity, RotationalSymmetry};

use crate::decimal::decimal;
use crate::error::Result;
use crate::lengths::{EdgeHeight, Lengths};
use crate::plan_view::ErrorLength;
use crate::taught::TaughtDemonstration;
use crate::verification::{SearchedImage, refined_from};

/// Standard deviation of the difference between two grasps marked by hand, in pixels. Chosen by hand: a pixel each.
const MARKS_PX: f64 = std::f64::consts::SQRT_2;
/// Maximum deviation of a displacement, in standard deviations of the marks and heights. Chosen by hand.
const MAX_SIGMAS: f64 = 3.0;
/// Maximum angle between the refined pose and the marks, in radians. Chosen by hand.
const MAX_TURN: f64 = 0.35;
/// Minimum agreement of the refined pose. Chosen by hand.
const MIN_AGREEMENT: f64 = 0.3;
/// Maximum standard deviation of a measured height, relative to that without measurement: photos from nearly the same
/// side do not show the height. Chosen by hand.
const MAX_SIGMA_SHARE: f64 = 0.8;

/// The edge height; `None` if no two photos show it. The photos are plan views, and `taught` are their demonstrations,
/// for a known size.
pub(super) fn edge_height(
    taught: &[TaughtDemonstration],
    photos: &[Demonstration],
    symmetry: RotationalSymmetry,
    lengths: &Lengths,
) -> Result<Option<EdgeHeight>> {
    let line = |photo: &Demonstration| Ok(*photo.annotation.require_grasp()?);
    let marked = photos.iter().map(line).collect::<Result<Vec<GraspLine>>>()?;
    let change = |from: usize, to: usize, turn: Angle| lengths.changed_slant(lengths.slant_of(to), from, turn);
    let marked_change = |from: usize, to: usize| change(from, to, marked[to].angle() - marked[from].angle());
    // Without a measurement, the edges' height has the standard deviation on which the stated errors are based.
    let usual_m = ErrorLength::POSITION.by_slant * lengths.mark_height_m;
    let marks_m = MARKS_PX / lengths.pixels_per_m;
    let mut pairs = BTreeSet::new();
    let (mut count, mut along_m, mut square) = (0.0, 0.0, 0.0);
    for (from, demonstration) in taught.iter().enumerate() {
        // The photo that differs most shows the height best.
        let others = (0..marked.len()).filter(|to| *to != from);
        let farthest = others.max_by(|a, b| marked_change(from, *a).norm().total_cmp(&marked_change(from, *b).norm()));
        let Some(to) = farthest else { continue };
        let starts = [-1.0, 0.0, 1.0].map(|sigmas| marked_change(from, to) * (sigmas * usual_m * lengths.pixels_per_m));
        let Some((moved_px, angle)) = displacement(demonstration, &photos[to], &marked[to], symmetry, &starts) else {
            continue;
        };
        let change = change(from, to, angle - marked[from].angle());
        let moved_m = moved_px / lengths.pixels_per_m;
        // Only a displacement within the errors of marks and usual heights is one by a height.
        if moved_m.norm() > MAX_SIGMAS * marks_m.hypot(usual_m * change.norm()) {
            continue;
        }
        pairs.insert([from.min(to), from.max(to)]);
        count += 1.0;
        along_m += change.dot(&moved_m);
        square += change.norm_squared();
    }
    if pairs.is_empty() || usual_m == 0.0 {
        return Ok(None);
    }
    // Least squares with the usual height as prior. N photos give at most N − 1 independent equations.
    let independent = pairs.len().min(marked.len() - 1) as f64;
    let information = independent / count * square + (marks_m / usual_m).powi(2);
    let sigma_m = marks_m / information.sqrt();
    let height_m = independent / count * along_m / information;
    let is_measured = sigma_m <= MAX_SIGMA_SHARE * usual_m;
    Ok(is_measured.then(|| EdgeHeight { height_m: decimal(height_m), sigma_m: decimal(sigma_m) }))
}

/// The grasp in a photo according to the demonstration's edges minus the marked grasp, in pixels, and the angle of the
/// former; `None` if the edges do not fit near the marks. The refinement begins at the marks moved by each of `starts`.
fn displacement(
    taught: &TaughtDemonstration,
    photo: &Demonstration,
    marked: &GraspLine,
    symmetry: RotationalSymmetry,
    starts: &[Vector2<f64>],
) -> Option<(Vector2<f64>, Angle)> {
    let searched = SearchedImage::new(&photo.image, std::slice::from_ref(taught));
    let line = &taught.marks.grasp;
    let refined = starts.iter().filter_map(|start| {
        let turn = marked.angle() - line.angle();
        refined_from(&searched, &PlanarSimilarity::about(line.center(), marked.center() + start, turn, 1.0))
    });
    let best = refined.max_by(|a, b| a.agreement.total_cmp(&b.agreement))?;
    let found = line.transformed(&best.image_from_cutout);
    let fits = symmetry.distance(found.angle(), marked.angle()) <= MAX_TURN && best.agreement >= MIN_AGREEMENT;
    fits.then(|| (found.center() - marked.center(), found.angle()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::teach::tests::demonstration;
    use image::imageops;
    use nalgebra::Point2;

    /// A pixel is a millimetre.
    const PIXELS_PER_M: f64 = 1000.0;
    const MARK_HEIGHT_M: f64 = 0.03;
    const SLANTS: [[f64; 2]; 2] = [[0.2, 0.1], [0.3, -0.4]];

    /// The photo rotated by half a turn, with the edges moved by these pixels and the marks not.
    fn rotated(photo: &Demonstration, [x, y]: [i64; 2]) -> Demonstration {
        let mut other = photo.clone();
        let turned = imageops::rotate180(&photo.image);
        other.image = turned.clone();
        imageops::replace(&mut other.image, &turned, x, y);
        let (width, height) = turned.dimensions();
        let about = |p: &Point2<f64>| Point2::new(f64::from(width) - p.x, f64::from(height) - p.y);
        let line = photo.annotation.grasp.unwrap();
        other.annotation.grasp = Some(GraspLine::new(about(&line.start), about(&line.end)));
        let outline = other.annotation.outline.as_mut().unwrap();
        outline.vertices.iter_mut().for_each(|p| *p = about(p) + Vector2::new(x as f64, y as f64));
        other.annotation.bbox = outline.bounds();
        other
    }

    fn measured(photos: &[Demonstration], further_slants: &[[f64; 2]]) -> Option<EdgeHeight> {
        measured_of(MARK_HEIGHT_M, photos, further_slants)
    }

    fn measured_of(mark_height_m: f64, photos: &[Demonstration], further_slants: &[[f64; 2]]) -> Option<EdgeHeight> {
        let level = Lengths::of_level_photos(PIXELS_PER_M, mark_height_m, 0.005);
        let lengths = Lengths { slant: SLANTS[0], further_slants: further_slants.to_vec(), ..level };
        let taught: Vec<_> = photos.iter().map(|photo| TaughtDemonstration::new(photo).unwrap()).collect();
        edge_height(&taught, photos, RotationalSymmetry::None, &lengths).unwrap()
    }

    #[test]
    fn the_height_follows_from_the_displacement_and_the_slants() {
        // The change of the slant from the first photo to the second, which is rotated by half a turn: (0.5, -0.3).
        // The prior is (√2 mm / 13 mm)² beside 0.5² + 0.3².
        let prior = 2.0 / (0.436f64 * 30.0).powi(2);
        let photo = demonstration();
        for (height_mm, moved) in [(10.0, [5, -3]), (-10.0, [-5, 3]), (0.0, [0, 0])] {
            let other = rotated(&photo, moved);
            let EdgeHeight { height_m, sigma_m } = measured(&[photo.clone(), other], &SLANTS[1..]).unwrap();
            let expected_mm = height_mm * 0.34 / (0.34 + prior);
            assert!((1e3 * height_m - expected_mm).abs() < 0.4, "{height_mm} mm: {height_m} m");
            assert!((1e3 * sigma_m - (2.0 / (0.34 + prior)).sqrt()).abs() < 0.01, "{sigma_m} m");
        }
        // A displacement across the change of the slant is an error of the marks.
        let across = measured(&[photo.clone(), rotated(&photo, [3, 5])], &SLANTS[1..]).unwrap();
        assert!(across.height_m.abs() < 1e-3, "{across:?}");
    }

    #[test]
    fn displacements_that_no_usual_height_explains_are_left_out() {
        let photo = demonstration();
        // Marks 5 mm high: with this change of the slant, three standard deviations of heights and marks are 5.7 pixels.
        let of = |height_m, moved| measured_of(height_m, &[photo.clone(), rotated(&photo, moved)], &SLANTS[1..]);
        assert!(of(0.005, [2, -1]).is_some());
        assert_eq!(of(0.005, [7, -4]), None);
        assert!(of(MARK_HEIGHT_M, [7, -4]).is_some());
    }

    #[test]
    fn a_third_photo_makes_the_height_more_certain() {
        let photo = demonstration();
        let other = rotated(&photo, [5, -3]);
        let two = measured(&[photo.clone(), other.clone()], &SLANTS[1..]).unwrap();
        let three = measured(&[photo, other.clone(), other], &[SLANTS[1], SLANTS[1]]).unwrap();
        assert!(three.sigma_m < 0.8 * two.sigma_m, "{two:?}, {three:?}");
    }

    #[test]
    fn nothing_is_measured_with_one_photo_or_from_one_side() {
        let photo = demonstration();
        assert_eq!(measured(std::slice::from_ref(&photo), &[]), None);
        // Rotated by half a turn, this slant is that of the first photo.
        let same_side = SLANTS[0].map(|tangent| -tangent);
        assert_eq!(measured(&[photo.clone(), rotated(&photo, [1, 0])], &[same_side]), None);
    }
}
