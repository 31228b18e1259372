//! Draws demonstrations and detections.

use image::RgbImage;
use nalgebra::Point2;
use sdg_geometry::{BoundingBox, GraspLine, Keypoint, PlanarGrasp, Polygon};

use super::{
    Color, Pen, draw_box, draw_grasp_jaws, draw_keypoints, draw_label, draw_line, draw_polygon, shade_polygon,
};
use crate::html::format_number;

/// The result of comparing a detection with the demonstration.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// The demonstration agrees with the image.
    Verified,
    /// The demonstration does not agree: the detection must not be grasped.
    Refused,
    /// The comparison was skipped.
    Unchecked,
}

impl Verdict {
    /// The colour of detections with this verdict.
    #[must_use]
    pub fn color(self) -> Color {
        match self {
            Self::Verified => Color::VERIFIED,
            Self::Refused => Color::REFUSED,
            Self::Unchecked => Color::NEUTRAL,
        }
    }

    fn word(self) -> &'static str {
        match self {
            Self::Verified => "verified",
            Self::Refused => "refused",
            Self::Unchecked => "unchecked",
        }
    }
}

/// A detection to draw; all fields except score and verdict are optional.
#[derive(Debug, Clone, Copy)]
pub struct DetectionMark<'a> {
    /// The detected box.
    pub bounds: Option<BoundingBox>,
    /// The demonstration's outline, placed in the image.
    pub outline: Option<&'a Polygon>,
    /// The detected keypoints.
    pub keypoints: &'a [Keypoint],
    /// The resulting grasp.
    pub grasp: Option<PlanarGrasp>,
    /// The final score, 0 to 1.
    pub score: f64,
    /// The verdict of the verification.
    pub verdict: Verdict,
    /// Number of the part, which is written before the score.
    pub number: Option<u64>,
}

/// Line width for a picture: 3 pixels at 640 columns, so that marks and tags are readable when a row of the page has
/// three pictures.
pub fn line_width(image: &RgbImage) -> f64 {
    (f64::from(image.width().max(image.height())) / 213.0).clamp(1.0, 8.0)
}

/// Draws a demonstration: its box, its outline, the marked line, and the grasp as two jaws.
pub fn draw_demonstration(
    image: &mut RgbImage,
    bounds: &BoundingBox,
    outline: Option<&Polygon>,
    line: Option<&GraspLine>,
    grasp: Option<&PlanarGrasp>,
) {
    let width = line_width(image);
    if let Some(outline) = outline {
        shade_polygon(image, outline, Color::OUTLINE, 0.14);
        draw_polygon(image, outline, &Pen::new(Color::OUTLINE).width(0.6 * width));
    }
    draw_box(image, bounds, &Pen::new(Color::BOX).width(0.8 * width));
    if let Some(line) = line {
        let pen = Pen::new(Color::NEUTRAL).width(0.6 * width);
        draw_line(image, line.start, line.end, &pen.dashed(3.0 * width, 2.5 * width));
        draw_keypoints(image, &line.keypoints(2), &pen.width(1.2 * width));
    }
    if let Some(grasp) = grasp {
        draw_grasp_jaws(image, grasp, &Pen::new(Color::GRASP).width(width));
    }
}

/// Draws a detection: box, outline, keypoints, a tag with score and verdict, and the grasp as a gripper.
///
/// A refused detection has a dashed box and no gripper, because it is not grasped.
pub fn draw_detection(image: &mut RgbImage, mark: &DetectionMark<'_>) {
    let width = line_width(image);
    let color = mark.verdict.color();
    let refused = mark.verdict == Verdict::Refused;
    if let Some(outline) = mark.outline {
        draw_polygon(image, outline, &Pen::new(Color::OUTLINE).width(0.5 * width));
    }
    if let Some(bounds) = &mark.bounds {
        let pen = Pen::new(color).width(width);
        draw_box(image, bounds, &if refused { pen.dashed(4.0 * width, 3.0 * width) } else { pen });
    }
    draw_keypoints(image, mark.keypoints, &Pen::new(Color::NEUTRAL).width(0.7 * width));
    if let Some(grasp) = mark.grasp.filter(|_| !refused) {
        draw_grasp_jaws(image, &grasp, &Pen::new(Color::GRASP).width(width));
    }
    let anchor = match (&mark.bounds, mark.grasp) {
        (Some(bounds), _) => Point2::new(bounds.x1 - 0.4 * width, bounds.y1 - 0.9 * width),
        (None, Some(grasp)) => grasp.center(),
        (None, None) => return,
    };
    let number = mark.number.map(|number| format!("part {number}: ")).unwrap_or_default();
    let text = format!("{number}{} {}", format_number(mark.score, 2), mark.verdict.word());
    draw_label(image, anchor, &text, color, 5.6 * width);
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use sdg_geometry::Angle;

    fn holds(image: &RgbImage, color: Color) -> bool {
        image.pixels().any(|pixel| pixel.0 == color.0)
    }

    fn mark(verdict: Verdict) -> DetectionMark<'static> {
        DetectionMark {
            bounds: Some(BoundingBox::new(80.0, 60.0, 240.0, 180.0).unwrap()),
            outline: None,
            keypoints: &[],
            grasp: Some(PlanarGrasp { x: 160.0, y: 120.0, angle: Angle::ZERO, width: 60.0 }),
            score: 0.97,
            verdict,
            number: None,
        }
    }

    #[test]
    fn a_gripper_is_drawn_only_where_the_robot_may_go() {
        let mut image = RgbImage::new(320, 240);
        draw_detection(&mut image, &mark(Verdict::Verified));
        assert!(holds(&image, Color::GRASP) && holds(&image, Color::VERIFIED));
        let mut image = RgbImage::new(320, 240);
        draw_detection(&mut image, &mark(Verdict::Refused));
        assert!(!holds(&image, Color::GRASP) && holds(&image, Color::REFUSED));
    }

    #[test]
    fn a_demonstration_shows_what_it_has() {
        let mut image = RgbImage::new(320, 240);
        let bounds = BoundingBox::new(80.0, 60.0, 240.0, 180.0).unwrap();
        draw_demonstration(&mut image, &bounds, None, None, None);
        assert!(!holds(&image, Color::GRASP));
        let line = GraspLine::new(Point2::new(120.0, 120.0), Point2::new(200.0, 120.0));
        let grasp = PlanarGrasp::from_line(&line, 50.0);
        draw_demonstration(&mut image, &bounds, Some(&Polygon::from_box(&bounds)), Some(&line), Some(&grasp));
        assert!(holds(&image, Color::GRASP) && holds(&image, Color::NEUTRAL));
    }
}
