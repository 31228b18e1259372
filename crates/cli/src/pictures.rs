//! Pictures with our marks on them.

use image::{Rgb, RgbImage};
use nalgebra::Point2;
use sdg_geometry::Keypoint;
use sdg_grasp::{Differences, GraspDetection};
use sdg_report::{Color, DetectionMark, Verdict, draw_detection, draw_label};

use crate::found_text::DEFAULT_MIN_SCORE;

/// The image with every detection drawn on it.
pub fn with_detections(image: &RgbImage, detections: &[GraspDetection]) -> RgbImage {
    let mut drawn = image.clone();
    draw_detections(&mut drawn, detections.iter(), DEFAULT_MIN_SCORE);
    drawn
}

/// Draws detections, the best first in their order; those that score at least `min_score` as accepted.
pub fn draw_detections<'a>(
    drawn: &mut RgbImage,
    detections: impl DoubleEndedIterator<Item = &'a GraspDetection>,
    min_score: f64,
) {
    // Worst first, so that the best is on top.
    for detection in detections.rev() {
        let keypoints: Vec<Keypoint> = detection.keypoints.iter().map(|(point, _)| Keypoint::visible(*point)).collect();
        let verdict = match (detection.score >= min_score, detection.agreement) {
            (false, _) => Verdict::Refused,
            (true, Some(_)) => Verdict::Verified,
            (true, None) => Verdict::Unchecked,
        };
        let mark = DetectionMark {
            bounds: Some(detection.bbox),
            outline: detection.outline.as_ref(),
            keypoints: &keypoints,
            grasp: Some(detection.grasp),
            score: detection.score,
            verdict,
        };
        draw_detection(drawn, &mark);
    }
}

/// Colours of the dots where edges and surface differ: apart in lightness, too.
const EDGES: Color = Color([255, 40, 60]);
const SURFACE: Color = Color([90, 150, 255]);
/// Dots of a picture this large are a pixel wide; those of larger ones grow with it.
const DOT_PX_PER_SIDE: f64 = 400.0;

/// Draws a dot wherever edges (red) or surface (blue) differ from the demonstration, and what the colours mean; nothing where
/// nothing differs.
pub fn draw_differences(drawn: &mut RgbImage, differences: &[Differences]) {
    let side = f64::from(drawn.width().max(drawn.height()));
    let radius = (0.5 * side / DOT_PX_PER_SIDE).max(0.5);
    for differences in differences {
        differences.surface.iter().for_each(|at| dot(drawn, at, radius, SURFACE));
        differences.edges.iter().for_each(|at| dot(drawn, at, radius, EDGES));
    }
    let text_px = (side / 60.0).max(8.0);
    let mut bottom = f64::from(drawn.height());
    let shows = |places: fn(&Differences) -> &[Point2<f64>]| differences.iter().any(|one| !places(one).is_empty());
    let legend = [
        (shows(|one| &one.surface), "surface differs from the photo", SURFACE),
        (shows(|one| &one.edges), "edges differ from the photo", EDGES),
    ];
    for (_, text, color) in legend.into_iter().filter(|(is_shown, ..)| *is_shown) {
        draw_label(drawn, Point2::new(0.0, bottom), text, color, text_px);
        bottom -= 2.5 * text_px;
    }
}

/// Writes a reason below a detection's box.
pub fn draw_reason(drawn: &mut RgbImage, detection: &GraspDetection, reason: &str) {
    let text_px = (f64::from(drawn.width().max(drawn.height())) / 60.0).max(8.0);
    let below = Point2::new(detection.bbox.x1, detection.bbox.y2 + 3.0 * text_px);
    draw_label(drawn, below, reason, Color::REFUSED, text_px);
}

/// A filled square of side 2 · `radius`, clipped to the picture.
fn dot(drawn: &mut RgbImage, at: &Point2<f64>, radius: f64, color: Color) {
    if !(0.0..f64::from(drawn.width())).contains(&at.x) || !(0.0..f64::from(drawn.height())).contains(&at.y) {
        return;
    }
    let span = |middle: f64, end: u32| {
        let [from, to] = [middle - radius, middle + radius].map(|edge| edge.round().clamp(0.0, f64::from(end)) as u32);
        from..to.max(from + 1).min(end)
    };
    for y in span(at.y, drawn.height()) {
        for x in span(at.x, drawn.width()) {
            drawn.put_pixel(x, y, Rgb(color.0));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differences_are_dots_at_their_places_with_a_legend() {
        let count = |picture: &RgbImage, color: Color| picture.pixels().filter(|pixel| pixel.0 == color.0).count();
        let mut drawn = RgbImage::new(400, 300);
        draw_differences(&mut drawn, &[Differences::default()]);
        assert_eq!(drawn, RgbImage::new(400, 300));
        let at = [Point2::new(100.5, 50.5), Point2::new(399.9, 299.9), Point2::new(-5.0, 10.0)];
        draw_differences(&mut drawn, &[Differences { edges: at.to_vec(), surface: Vec::new() }]);
        assert_eq!(drawn.get_pixel(100, 50).0, EDGES.0);
        assert_eq!(drawn.get_pixel(0, 10).0, [0; 3]);
        assert!(count(&drawn, EDGES) > 100 && count(&drawn, SURFACE) == 0);
    }
}
