//! Draws demonstrations and detections.

use image::RgbImage;
use nalgebra::Point2;
use sdg_geometry::{BoundingBox, GraspLine, Keypoint, PlanarGrasp, Polygon};

use super::{
    Color, Pen, draw_box, draw_grasp_jaws, draw_keypoints, draw_label, draw_line, draw_polygon, label_bounds,
    shade_polygon,
};
use crate::html::format_number;

/// Maximum width of a tag with a word, relative to the width of the detection's box; chosen by eye.
const MAX_TAG_SHARE: f64 = 2.0;
/// Maximum height of a tag's capitals, as a fraction of the diagonal of the detection's box, unless this is below
/// [`MIN_TEXT_PX`]; chosen by eye.
const MAX_TEXT_SHARE: f64 = 0.12;
const MIN_TEXT_PX: f64 = 9.0;
/// Maximum line width of a gripper, as a fraction of the grasp's width, so that it hides little of a small part's
/// neighbours; chosen by eye.
const MAX_GRIPPER_SHARE: f64 = 0.1;

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

/// Line width for a picture: 3 pixels if the longer side is 640, so that marks and tags are readable when a row of the
/// page has three pictures.
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

/// Draws detections, given in order of decreasing score: boxes, outlines, keypoints, grasps as grippers, and tags with
/// score and verdict. Each tag is at the corner of its detection's box where it covers least of the earlier tags and of
/// the grasps' middles. Returns the areas of the tags.
///
/// A refused detection has a dashed box and no gripper, because it is not grasped.
pub fn draw_detections(image: &mut RgbImage, marks: &[DetectionMark<'_>]) -> Vec<BoundingBox> {
    let width = line_width(image);
    // In reverse order, so that the best detection is on top.
    marks.iter().rev().for_each(|mark| draw_untagged(image, mark));
    let mut occupied: Vec<BoundingBox> = marks
        .iter()
        .filter_map(DetectionMark::grasped)
        .map(|grasp| {
            let half = 5.0 * width;
            BoundingBox { x1: grasp.x - half, y1: grasp.y - half, x2: grasp.x + half, y2: grasp.y + half }
        })
        .collect();
    let num_grasps = occupied.len();
    for mark in marks {
        let number = mark.number.map(|number| format!("part {number}: ")).unwrap_or_default();
        let height_px = mark.text_height_px(width);
        let score = format!("{number}{}", format_number(mark.score, 2));
        let in_words = format!("{score} {}", mark.verdict.word());
        let is_wide = |bounds: &BoundingBox| {
            label_bounds(image, Point2::origin(), &in_words, height_px).width() > MAX_TAG_SHARE * bounds.width()
        };
        // The colour shows the verdict, too.
        let text = if mark.bounds.as_ref().is_some_and(is_wide) { score } else { in_words };
        let tag = |at: Point2<f64>| label_bounds(image, at, &text, height_px);
        let covered = |tag: &BoundingBox| occupied.iter().map(|other| other.intersection(tag)).sum::<f64>();
        let size = tag(Point2::origin());
        let anchors = mark.tag_anchors(width, [size.width(), size.height()]);
        let Some(at) = anchors.into_iter().min_by(|one, other| covered(&tag(*one)).total_cmp(&covered(&tag(*other))))
        else {
            continue;
        };
        occupied.push(tag(at));
        draw_label(image, at, &text, mark.verdict.color(), height_px);
    }
    occupied.split_off(num_grasps)
}

fn draw_untagged(image: &mut RgbImage, mark: &DetectionMark<'_>) {
    let width = line_width(image);
    if let Some(outline) = mark.outline {
        draw_polygon(image, outline, &Pen::new(Color::OUTLINE).width(0.5 * width));
    }
    if let Some(bounds) = &mark.bounds {
        let pen = Pen::new(mark.verdict.color()).width(width);
        let is_refused = mark.verdict == Verdict::Refused;
        draw_box(image, bounds, &if is_refused { pen.dashed(4.0 * width, 3.0 * width) } else { pen });
    }
    draw_keypoints(image, mark.keypoints, &Pen::new(Color::NEUTRAL).width(0.7 * width));
    if let Some(grasp) = mark.grasped() {
        let thin = width.min((MAX_GRIPPER_SHARE * grasp.width).max(1.0));
        draw_grasp_jaws(image, &grasp, &Pen::new(Color::GRASP).width(thin));
    }
}

impl DetectionMark<'_> {
    /// The grasp, unless the detection is refused.
    fn grasped(&self) -> Option<PlanarGrasp> {
        self.grasp.filter(|_| self.verdict != Verdict::Refused)
    }

    /// Height of the tag's capitals: smaller at a small part.
    fn text_height_px(&self, line_width: f64) -> f64 {
        let by_box = self.bounds.map(|bounds| MAX_TEXT_SHARE * bounds.width().hypot(bounds.height()));
        (5.6 * line_width).min(by_box.unwrap_or(f64::INFINITY).max(MIN_TEXT_PX))
    }

    /// Lower left corners of a tag of this width and height, the preferred one first: above the box, below it, and
    /// inside it, each at the left and at the right; without a box, at the grasp.
    fn tag_anchors(&self, line_width: f64, [width, height]: [f64; 2]) -> Vec<Point2<f64>> {
        let Some(bounds) = &self.bounds else { return self.grasp.iter().map(PlanarGrasp::center).collect() };
        let (beside, gap) = (0.4 * line_width, 0.9 * line_width);
        let columns = [bounds.x1 - beside, bounds.x2 + beside - width];
        let rows = [bounds.y1 - gap, bounds.y2 + gap + height, bounds.y1 + gap + height, bounds.y2 - gap];
        rows.into_iter().flat_map(|y| columns.map(|x| Point2::new(x, y))).collect()
    }
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
        draw_detections(&mut image, &[mark(Verdict::Verified)]);
        assert!(holds(&image, Color::GRASP) && holds(&image, Color::VERIFIED));
        let mut image = RgbImage::new(320, 240);
        draw_detections(&mut image, &[mark(Verdict::Refused)]);
        assert!(!holds(&image, Color::GRASP) && holds(&image, Color::REFUSED));
    }

    #[test]
    fn tags_of_close_detections_cover_neither_each_other_nor_a_grasp() {
        let at = |x: f64, y: f64| {
            let bounds = BoundingBox::new(x, y, x + 60.0, y + 40.0).unwrap();
            let grasp = PlanarGrasp { x: x + 30.0, y: y + 20.0, angle: Angle::ZERO, width: 30.0 };
            DetectionMark { bounds: Some(bounds), grasp: Some(grasp), ..mark(Verdict::Verified) }
        };
        let marks = [at(100.0, 100.0), at(110.0, 104.0), at(90.0, 130.0), at(95.0, 60.0)];
        let mut image = RgbImage::new(320, 240);
        let tags = draw_detections(&mut image, &marks);
        assert_eq!(tags.len(), marks.len());
        for (i, tag) in tags.iter().enumerate() {
            assert!(tags[..i].iter().all(|other| other.intersection(tag) == 0.0), "{tags:?}");
            assert!(marks.iter().all(|mark| !tag.contains(&mark.grasp.unwrap().center())), "{tags:?}");
        }
        // The first tag has the preferred place, above the left corner of its box.
        assert!(tags[0].y2 < 100.0 && (tags[0].x1 - 100.0).abs() < 2.0, "{tags:?}");
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
