//! The height of the compared edges above the plane of the marks, measured with further photos of a calibrated camera.
//!
//! A detection lays the edges of one photo over another picture. Edges higher than the marks appear displaced away from
//! the camera, by their height times the tangent of the line of sight's angle from the vertical:
//! ```text
//! grasp according to the edges − marked grasp = edge height · (slant of the picture − slant of the photo, rotated)
//! ```
//! Each pair of photos that show the part from different sides gives such an equation.

use nalgebra::{Rotation2, Vector2};
use sdg_demonstration::Demonstration;
use sdg_geometry::{GraspLine, PlanarSimilarity};

use crate::decimal::decimal;
use crate::error::Result;
use crate::lengths::{EdgeHeight, Lengths};
use crate::taught::TaughtDemonstration;
use crate::verification::{SearchedImage, refined_from};

/// Standard deviation of edge heights: RMS of the four shipped parts over 20 mm high
/// (docs/decisions/027-heights-and-slants.md).
const USUAL_HEIGHT_M: f64 = 0.004;
/// Standard deviation of a grasp marked by hand, in pixels of the photo. Chosen by hand.
const MARKS_PX: f64 = 1.0;
/// Heights at which the refinement starts, in metres. Chosen from the heights of these parts.
const START_HEIGHTS_M: [f64; 3] = [-0.006, 0.0, 0.006];
/// Maximum displacement in diagonals of the part's box: larger ones are errors of the refinement. Chosen by hand: half
/// the diagonal as height, and a tangent of 0.4.
const MAX_MOVED: f64 = 0.2;
/// Maximum angle between the refined pose and the marks, in radians. Chosen by hand.
const MAX_TURN: f64 = 0.35;
/// Minimum agreement of the refined pose. Chosen by hand.
const MIN_AGREEMENT: f64 = 0.3;

/// The edge height; `None` if no two photos show it. The photos are plan views, and `taught` are their demonstrations,
/// for a known size.
pub(super) fn edge_height(
    taught: &[TaughtDemonstration],
    photos: &[Demonstration],
    lengths: &Lengths,
) -> Result<Option<EdgeHeight>> {
    let line = |photo: &Demonstration| Ok(*photo.annotation.require_grasp()?);
    let marked = photos.iter().map(line).collect::<Result<Vec<GraspLine>>>()?;
    let change = |from: usize, to: usize| {
        let turn = Rotation2::new((marked[to].angle() - marked[from].angle()).radians());
        Vector2::from(lengths.slant_of(to)) - turn * Vector2::from(lengths.slant_of(from))
    };
    let (mut pairs, mut along_m, mut square) = (0.0, 0.0, 0.0);
    for (from, demonstration) in taught.iter().enumerate() {
        // The photo that differs most shows the height best.
        let others = (0..marked.len()).filter(|to| *to != from);
        let farthest = others.max_by(|a, b| change(from, *a).norm().total_cmp(&change(from, *b).norm()));
        let Some(to) = farthest else { continue };
        let change = change(from, to);
        let pixels = change * lengths.pixels_per_m;
        if let Some(moved_px) = displacement(demonstration, &photos[to], &marked[to], &pixels) {
            pairs += 1.0;
            along_m += change.dot(&moved_px) / lengths.pixels_per_m;
            square += change.norm_squared();
        }
    }
    if pairs == 0.0 {
        return Ok(None);
    }
    // Least squares with the usual height as prior. The pairs contain the errors of marks of one photo fewer.
    let independent = (marked.len() as f64 - 1.0).min(pairs);
    let marks_m = MARKS_PX / lengths.pixels_per_m;
    let information = independent / pairs * square + (marks_m / USUAL_HEIGHT_M).powi(2);
    let height_m = independent / pairs * along_m / information;
    Ok(Some(EdgeHeight { height_m: decimal(height_m), sigma_m: decimal(marks_m / information.sqrt()) }))
}

/// The grasp in a photo according to the demonstration's edges minus the marked grasp, in pixels; `None` if the edges
/// do not fit near the marks. `pixels_per_height` is the displacement of edges one metre above the marks.
fn displacement(
    taught: &TaughtDemonstration,
    photo: &Demonstration,
    marked: &GraspLine,
    pixels_per_height: &Vector2<f64>,
) -> Option<Vector2<f64>> {
    let searched = SearchedImage::new(&photo.image, std::slice::from_ref(taught));
    let line = &taught.marks.grasp;
    let refined = START_HEIGHTS_M.into_iter().filter_map(|height_m| {
        let at = marked.center() + pixels_per_height * height_m;
        let start = PlanarSimilarity::about(line.center(), at, marked.angle() - line.angle(), 1.0);
        refined_from(&searched, &start)
    });
    let best = refined.max_by(|a, b| a.agreement.total_cmp(&b.agreement))?;
    let found = line.transformed(&best.image_from_cutout);
    let moved_px = found.center() - marked.center();
    let bounds = photo.annotation.bbox;
    let is_near = moved_px.norm() <= MAX_MOVED * bounds.width().hypot(bounds.height())
        && found.angle().distance(marked.angle()) <= MAX_TURN;
    (is_near && best.agreement >= MIN_AGREEMENT).then_some(moved_px)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::teach::tests::demonstration;
    use image::imageops;

    const PIXELS_PER_M: f64 = 1000.0;
    const FURTHER: [f64; 2] = [0.4, -0.5];

    /// Plan views from above and from the side, in which the edges are moved by these pixels and the marks are not.
    fn measured(moved: Option<[i64; 2]>) -> Option<EdgeHeight> {
        let photo = demonstration();
        let mut photos = vec![photo.clone()];
        if let Some([x, y]) = moved {
            let mut other = photo.clone();
            imageops::replace(&mut other.image, &photo.image, x, y);
            let by = Vector2::new(x as f64, y as f64);
            let outline = other.annotation.outline.as_mut().unwrap();
            outline.vertices.iter_mut().for_each(|vertex| *vertex += by);
            other.annotation.bbox = outline.bounds();
            photos.push(other);
        }
        let lengths = Lengths { further_slants: vec![FURTHER], ..Lengths::of_level_photos(PIXELS_PER_M, 0.01, 0.005) };
        let taught: Vec<_> = photos.iter().map(|photo| TaughtDemonstration::new(photo).unwrap()).collect();
        edge_height(&taught, &photos, &lengths).unwrap()
    }

    #[test]
    fn the_height_follows_from_the_displacement_and_the_slants() {
        // A pixel is a millimetre. The prior is that of two photos: (1 mm / 4 mm)² beside 0.4² + 0.5².
        let share = 0.41 / (0.41 + 0.0625);
        for (height_mm, moved) in [(10.0, [4, -5]), (-10.0, [-4, 5]), (0.0, [0, 0])] {
            let EdgeHeight { height_m, sigma_m } = measured(Some(moved)).unwrap();
            assert!((1e3 * height_m - share * height_mm).abs() < 0.3, "{height_mm} mm: {height_m} m");
            assert!((1e3 * sigma_m - 1.0 / (0.41f64 + 0.0625).sqrt()).abs() < 0.01, "{sigma_m} m");
        }
        // Displacements across the change of the slant are errors of the marks.
        let across = measured(Some([5, 4])).unwrap();
        assert!(across.height_m.abs() < 5e-4, "{across:?}");
    }

    #[test]
    fn nothing_is_measured_with_one_photo_or_far_from_the_marks() {
        assert_eq!(measured(None), None);
        assert_eq!(measured(Some([-16, 20])), None);
    }
}
