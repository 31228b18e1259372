//! Pictures with detections drawn on them.

use image::{Rgb, RgbImage};
use nalgebra::Point2;
use sdg_geometry::{BoundingBox, Keypoint};
use sdg_grasp::{Differences, GraspDetection, SearchRegion};
use sdg_report::{Color, DetectionMark, Pen, Verdict, draw_box, draw_label, draw_polygon, label_bounds, line_width};

use crate::live_detection::Part;

/// Default minimum score of accepted detections. Scores are calibrated so that this value separates correct detections
/// from wrong ones.
pub const DEFAULT_MIN_SCORE: f64 = 0.5;
/// Draws all detections on a copy of the image.
pub fn with_detections(image: &RgbImage, detections: &[GraspDetection]) -> RgbImage {
    let mut drawn = image.clone();
    draw_detections(&mut drawn, detections.iter(), DEFAULT_MIN_SCORE, &[], Vec::new());
    drawn
}

/// Draws detections, which are ordered by decreasing score. Those with at least `min_score` are drawn as accepted. If
/// any reasons are given, every refused detection gets a box, and one with a reason also its outline and a tag with
/// score and reason. Tags with reasons overlap neither each other nor the areas `taken` if there is room.
pub fn draw_detections<'a>(
    drawn: &mut RgbImage,
    detections: impl Iterator<Item = &'a GraspDetection>,
    min_score: f64,
    reasons: &[(&GraspDetection, String)],
    mut taken: Vec<BoundingBox>,
) {
    let (boxed, marked): (Vec<_>, Vec<_>) =
        detections.partition(|detection| detection.score < min_score && !reasons.is_empty());
    for detection in boxed.into_iter().rev() {
        let width = line_width(drawn);
        let explained = reasons.iter().any(|(known, _)| *known == detection);
        let share = if explained { 1.0 } else { 0.5 };
        let pen = Pen::new(Color::REFUSED).width(share * width).dashed(4.0 * width, 3.0 * width);
        draw_box(drawn, &detection.bbox, &pen);
        if let Some(outline) = detection.outline.as_ref().filter(|_| explained) {
            draw_polygon(drawn, outline, &Pen::new(Color::OUTLINE).width(0.5 * width));
        }
    }
    taken.extend(marked.iter().map(|detection| detection.bbox));
    let marked: Vec<_> = marked.into_iter().map(|detection| (detection, detection.score >= min_score, None)).collect();
    taken.extend(draw_marked(drawn, &marked));
    for (detection, reason) in reasons {
        draw_reason(drawn, detection, reason, &mut taken);
    }
}

/// Draws the visible parts of a frame, the best on top, with their scores and their track numbers, counted from 1.
pub fn draw_parts(drawn: &mut RgbImage, parts: &[Part], min_score: f64) {
    let mut seen: Vec<&Part> = parts.iter().filter(|part| part.is_seen(min_score)).collect();
    seen.sort_by(|one, other| one.by_score(other));
    let marked = seen.into_iter().map(|part| (&part.found.detection, true, part.track.map(|(number, ..)| number + 1)));
    let marked: Vec<_> = marked.collect();
    draw_marked(drawn, &marked);
}

/// Draws the border of the searched region, unless the whole picture is searched.
pub fn draw_region(drawn: &mut RgbImage, region: Option<&SearchRegion>) {
    let Some(region) = region else { return };
    let width = line_width(drawn);
    draw_box(drawn, &region.bounds(), &Pen::new(Color::NEUTRAL).width(width).dashed(8.0 * width, 4.0 * width));
}

/// Draws detections, each with its state (accepted or not) and its track number; returns the areas of their tags.
fn draw_marked(drawn: &mut RgbImage, detections: &[(&GraspDetection, bool, Option<u64>)]) -> Vec<BoundingBox> {
    let keypoints: Vec<Vec<Keypoint>> = detections
        .iter()
        .map(|(detection, ..)| detection.keypoints.iter().map(|(point, _)| Keypoint::visible(*point)).collect())
        .collect();
    let marks = detections.iter().zip(&keypoints).map(|((detection, is_accepted, number), keypoints)| DetectionMark {
        bounds: Some(detection.bbox),
        outline: detection.outline.as_ref(),
        keypoints,
        grasp: Some(detection.grasp),
        score: detection.score,
        verdict: match (is_accepted, detection.agreement) {
            (false, _) => Verdict::Refused,
            (true, Some(_)) => Verdict::Verified,
            (true, None) => Verdict::Unchecked,
        },
        number: *number,
    });
    let marks: Vec<_> = marks.collect();
    sdg_report::draw_detections(drawn, &marks)
}

/// Colours of the dots where edges or the surface differ; the two colours also differ in lightness, for colour-blind
/// users.
const EDGES: Color = Color([255, 40, 60]);
const SURFACE: Color = Color([90, 150, 255]);
/// Colour of the frames around squares in which a feature or print differs.
const FEATURES: Color = Color([255, 190, 0]);
/// Side of a picture, in pixels, up to which dots are one pixel wide. In larger pictures, dots are proportionally
/// wider.
const DOT_PX_PER_SIDE: f64 = 400.0;

/// Draws dots where edges (red) or the surface (blue) differ from the demonstration, frames (yellow) where a feature
/// differs, and a legend, which covers `parts` as little as possible; draws nothing if there are no differences.
/// Returns the legend's area.
pub fn draw_differences(drawn: &mut RgbImage, differences: &[Differences], parts: &[BoundingBox]) -> Vec<BoundingBox> {
    let side = f64::from(drawn.width().max(drawn.height()));
    let radius = (0.5 * side / DOT_PX_PER_SIDE).max(0.5);
    for differences in differences {
        differences.surface.iter().for_each(|at| dot(drawn, at, radius, SURFACE));
        differences.edges.iter().for_each(|at| dot(drawn, at, radius, EDGES));
        differences
            .features
            .iter()
            .for_each(|square| draw_polygon(drawn, square, &Pen::new(FEATURES).width(2.0 * radius).without_halo()));
    }
    let shows = |is_there: fn(&Differences) -> bool| differences.iter().any(is_there);
    let lines = [
        (shows(|one| !one.surface.is_empty()), "surface differs from the photo", SURFACE),
        (shows(|one| !one.edges.is_empty()), "edges differ from the photo", EDGES),
        (shows(|one| !one.features.is_empty()), "a feature differs from the photo", FEATURES),
    ];
    let lines: Vec<_> =
        lines.iter().filter(|(is_shown, ..)| *is_shown).map(|&(_, text, color)| (text, color)).collect();
    draw_legend(drawn, &lines, parts)
}

/// Height of the capitals of a legend or a reason, in pixels.
fn text_height_px(drawn: &RgbImage) -> f64 {
    (f64::from(drawn.width().max(drawn.height())) / 60.0).max(8.0)
}

/// Draws the legend in the corner in which it covers the parts least, preferably the lower left one; returns its area.
fn draw_legend(drawn: &mut RgbImage, lines: &[(&str, Color)], parts: &[BoundingBox]) -> Vec<BoundingBox> {
    let [width, height] = [drawn.width(), drawn.height()].map(f64::from);
    let text_px = text_height_px(drawn);
    let step = 2.5 * text_px;
    let in_corner = |[x, y]: [f64; 2]| -> Vec<(Point2<f64>, BoundingBox)> {
        let place = |(row, (text, _)): (usize, &(&str, Color))| {
            // The first line is the lowest one.
            let rows_down = if y > 0.0 { -(row as f64) } else { (lines.len() - 1 - row) as f64 };
            // The smallest y at which the line is inside the picture.
            let top = label_bounds(drawn, Point2::new(x, 0.0), text, text_px).y2;
            let at = Point2::new(x, y.max(top) + rows_down * step);
            (at, label_bounds(drawn, at, text, text_px))
        };
        lines.iter().enumerate().map(place).collect()
    };
    let covered = |tags: &[(Point2<f64>, BoundingBox)]| -> f64 {
        tags.iter().flat_map(|(_, tag)| parts.iter().map(|part| part.intersection(tag))).sum()
    };
    let corners = [[0.0, height], [width, height], [0.0, 0.0], [width, 0.0]].map(in_corner);
    // If several corners are equally good, the first one is used.
    let best = corners.into_iter().min_by(|a, b| covered(a).total_cmp(&covered(b))).unwrap_or_default();
    for ((at, _), (text, color)) in best.iter().zip(lines) {
        draw_label(drawn, *at, text, *color, text_px);
    }
    best.into_iter().map(|(_, tag)| tag).collect()
}

/// Writes score and reason below a detection's box, or further down if a tag or an accepted part is there.
fn draw_reason(drawn: &mut RgbImage, detection: &GraspDetection, reason: &str, taken: &mut Vec<BoundingBox>) {
    let text_px = text_height_px(drawn);
    let max_width = MAX_REASON_SHARE * f64::from(drawn.width());
    let is_short = |text: &str| label_bounds(drawn, Point2::origin(), text, text_px).width() <= max_width;
    let lines = wrapped(&format!("{:.2} refused: {reason}", detection.score), is_short);
    let step = 2.4 * text_px;
    let height = f64::from(drawn.height());
    let tags = |first: Point2<f64>| -> Vec<(Point2<f64>, BoundingBox)> {
        let place = |(row, line): (usize, &String)| {
            let at = Point2::new(first.x, first.y + row as f64 * LINE_SHARE * step);
            (at, label_bounds(drawn, at, line, text_px))
        };
        lines.iter().enumerate().map(place).collect()
    };
    let below = |row: usize| {
        // Below the bottom of the picture, the position wraps to the top.
        let y = (detection.bbox.y2 + 3.0 * text_px + row as f64 * step) % (height + step);
        Point2::new(detection.bbox.x1, y)
    };
    let is_free = |at: &Point2<f64>| {
        let tags = tags(*at);
        // Lines beyond the picture's edge would be moved into it, over each other.
        let is_inside = match tags.as_slice() {
            [(top, first), .., (bottom, _)] => first.height() <= top.y && bottom.y <= height,
            _ => true,
        };
        is_inside && tags.iter().all(|(_, tag)| taken.iter().all(|other| other.intersection(tag) == 0.0))
    };
    let rows = (height / step).ceil() as usize;
    let first = (0..rows).map(below).find(is_free).unwrap_or_else(|| below(0));
    for ((at, tag), line) in tags(first).into_iter().zip(&lines) {
        taken.push(tag);
        draw_label(drawn, at, line, Color::REFUSED, text_px);
    }
}

/// Maximum width of a line of a reason, as a fraction of the picture's width. Chosen by eye.
const MAX_REASON_SHARE: f64 = 0.45;
/// Line spacing within a reason, as a fraction of the step between the tried positions of a reason.
const LINE_SHARE: f64 = 0.85;

/// Splits a text into lines that are short or consist of one word.
fn wrapped(text: &str, is_short: impl Fn(&str) -> bool) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        match lines.last_mut() {
            Some(line) if is_short(&format!("{line} {word}")) => *line = format!("{line} {word}"),
            _ => lines.push(word.to_owned()),
        }
    }
    lines
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
    use sdg_geometry::Polygon;

    #[test]
    fn tags_of_refused_ones_do_not_cover_each_other() {
        let detection = |x: f64, score: f64| GraspDetection {
            demonstration_idx: 0,
            score,
            network_score: 0.0,
            agreement: Some(0.4),
            evidence: None,
            bbox: BoundingBox { x1: x, y1: 250.0, x2: x + 60.0, y2: 290.0 },
            keypoints: Vec::new(),
            outline: None,
            grasp: sdg_geometry::PlanarGrasp { x: x + 30.0, y: 270.0, angle: sdg_geometry::Angle::ZERO, width: 30.0 },
            turn_source: sdg_grasp::TurnSource::Search,
            light: 1.0,
        };
        let found = [detection(40.0, 0.4), detection(50.0, 0.3), detection(60.0, 0.2)];
        let mut taken = Vec::new();
        let mut drawn = RgbImage::new(400, 300);
        for one in &found {
            draw_reason(&mut drawn, one, "too little of it is visible", &mut taken);
        }
        for (i, one) in taken.iter().enumerate() {
            assert!(taken[..i].iter().all(|other| other.intersection(one) == 0.0), "{taken:?}");
            assert!(one.y2 <= 300.0 && one.y1 >= 0.0);
        }
    }

    #[test]
    fn a_region_is_a_frame_about_its_pixels() {
        let mut drawn = RgbImage::new(400, 300);
        draw_region(&mut drawn, None);
        assert_eq!(drawn, RgbImage::new(400, 300));
        draw_region(&mut drawn, Some(&SearchRegion::new([100, 50, 200, 160])));
        let is_bright = |x: u32, y: u32| drawn.get_pixel(x, y).0[0] > 128;
        let count = |points: &mut dyn Iterator<Item = (u32, u32)>| points.filter(|&(x, y)| is_bright(x, y)).count();
        assert!(count(&mut (100..300).map(|x| (x, 50))) > 100 && count(&mut (50..210).map(|y| (100, y))) > 80);
        assert_eq!(count(&mut (110..290).flat_map(|x| (60..200).map(move |y| (x, y)))), 0);
    }

    #[test]
    fn differences_are_dots_at_their_places_with_a_legend() {
        let count = |picture: &RgbImage, color: Color| picture.pixels().filter(|pixel| pixel.0 == color.0).count();
        let mut drawn = RgbImage::new(400, 300);
        draw_differences(&mut drawn, &[Differences::default()], &[]);
        assert_eq!(drawn, RgbImage::new(400, 300));
        let at = [Point2::new(100.5, 50.5), Point2::new(399.9, 299.9), Point2::new(-5.0, 10.0)];
        draw_differences(&mut drawn, &[Differences { edges: at.to_vec(), ..Differences::default() }], &[]);
        assert_eq!(drawn.get_pixel(100, 50).0, EDGES.0);
        assert_eq!(drawn.get_pixel(0, 10).0, [0; 3]);
        assert!(count(&drawn, EDGES) > 100 && count(&drawn, SURFACE) == 0 && count(&drawn, FEATURES) == 0);
        let square = BoundingBox { x1: 100.0, y1: 100.0, x2: 140.0, y2: 140.0 };
        let mut drawn = RgbImage::new(400, 300);
        draw_differences(
            &mut drawn,
            &[Differences { features: vec![Polygon::from_box(&square)], ..Differences::default() }],
            &[],
        );
        assert!(drawn.get_pixel(120, 100).0 != [0; 3] && drawn.get_pixel(120, 120).0 == [0; 3]);
    }

    #[test]
    fn the_legend_leaves_parts_in_a_corner_visible() {
        let [left, right] = [0.0, 300.0].map(|x1| BoundingBox { x1, y1: 240.0, x2: x1 + 100.0, y2: 300.0 });
        let both = Differences {
            edges: vec![Point2::new(200.5, 150.5)],
            surface: vec![Point2::new(200.5, 160.5)],
            ..Differences::default()
        };
        for (parts, corner) in [(vec![], [0, 299]), (vec![left], [399, 299]), (vec![left, right], [0, 0])] {
            let mut drawn = RgbImage::new(400, 300);
            let legend = draw_differences(&mut drawn, std::slice::from_ref(&both), &parts);
            assert!(legend.len() == 2 && legend[0].intersection(&legend[1]) == 0.0, "{legend:?}");
            assert!(legend.iter().all(|tag| parts.iter().all(|part| part.intersection(tag) == 0.0)), "{legend:?}");
            assert_ne!(drawn.get_pixel(corner[0], corner[1]).0, [0; 3], "at {corner:?}");
        }
    }
}
