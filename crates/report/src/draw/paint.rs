//! Strokes and fills: paths that tiny-skia rasterises with antialiasing, blended into a picture.
//!
//! All segments of a stroke form one path that is filled once, so that joints and crossings of a translucent stroke are
//! not drawn twice.

use image::RgbImage;
use nalgebra::Point2;
use sdg_geometry::Polygon;
use tiny_skia::{FillRule, LineCap, LineJoin, Mask, Path, PathBuilder, Stroke, Transform};

use super::{Color, Pen};

/// Width of the dark rim on each side of a line, in pixels.
pub(super) const HALO_WIDTH: f64 = 1.0;
pub(super) const HALO_COLOR: Color = Color([12, 14, 18]);
pub(super) const HALO_OPACITY: f64 = 0.45;

/// Blends a colour into the picture where the path covers it. Self-intersecting paths are filled by `rule`.
pub(super) fn fill(image: &mut RgbImage, path: Path, rule: FillRule, color: Color, opacity: f64) {
    let bounds = path.bounds();
    // Float to integer casts saturate: coordinates left of or above the picture become 0.
    let (x0, y0) = (bounds.left().floor() as u32, bounds.top().floor() as u32);
    let x1 = (bounds.right().ceil().max(0.0) as u32).min(image.width());
    let y1 = (bounds.bottom().ceil().max(0.0) as u32).min(image.height());
    if x0 >= x1 || y0 >= y1 {
        return;
    }
    let Some(mut mask) = Mask::new(x1 - x0, y1 - y0) else { return };
    mask.fill_path(&path, rule, true, Transform::from_translate(-(x0 as f32), -(y0 as f32)));
    let rows = mask.data().chunks_exact((x1 - x0) as usize);
    for (y, row) in (y0..).zip(rows) {
        for (x, coverage) in (x0..).zip(row) {
            let share = f32::from(*coverage) / 255.0 * opacity as f32;
            if share <= 0.0 {
                continue;
            }
            for (channel, &wanted) in image.get_pixel_mut(x, y).0.iter_mut().zip(&color.0) {
                let mixed = f32::from(*channel) * (1.0 - share) + f32::from(wanted) * share;
                *channel = mixed.round() as u8;
            }
        }
    }
}

/// The polygon of the corners, clipped to the picture, because tiny-skia panics on paths far outside. `None` if no part
/// is inside, or if a corner is not finite.
pub(super) fn inside_of(image: &RgbImage, corners: &[Point2<f64>]) -> Option<Path> {
    if corners.len() < 3 || !corners.iter().all(is_finite) {
        return None;
    }
    let polygon = Polygon { vertices: corners.to_vec() };
    let inside = polygon.clip(f64::from(image.width()), f64::from(image.height()));
    let mut path = PathBuilder::new();
    for (i, corner) in inside.vertices.iter().enumerate() {
        let (x, y) = (corner.x as f32, corner.y as f32);
        if i == 0 { path.move_to(x, y) } else { path.line_to(x, y) }
    }
    path.close();
    path.finish()
}

/// Strokes polylines with a pen, with its halo below.
pub(super) fn stroke(image: &mut RgbImage, polylines: &[Vec<Point2<f64>>], pen: &Pen) {
    if pen.halo {
        let rim = Pen { color: HALO_COLOR, width: pen.width + 2.0 * HALO_WIDTH, ..*pen };
        stroke_translucent(image, polylines, &rim, HALO_OPACITY);
    }
    stroke_translucent(image, polylines, pen, 1.0);
}

/// Strokes polylines with a pen and an opacity, with round ends and joints, and without a halo. A polyline of length
/// zero is a dot.
pub(super) fn stroke_translucent(image: &mut RgbImage, polylines: &[Vec<Point2<f64>>], pen: &Pen, opacity: f64) {
    if !(pen.width.is_finite() && pen.width > 0.0) {
        return;
    }
    // At this width, a line through the picture covers all of it.
    let [width, height] = [image.width(), image.height()].map(f64::from);
    let pen = Pen { width: pen.width.min(2.0 * (width + height)), ..*pen };
    let reach = 0.5 * pen.width + 1.0;
    let (high_x, high_y) = (width + reach, height + reach);
    let mut segments = Vec::new();
    for polyline in polylines {
        let mut travelled = 0.0;
        for pair in polyline.windows(2).filter(|pair| pair.iter().all(is_finite)) {
            if let Some((a, b)) = clip(pair[0], pair[1], -reach, high_x, -reach, high_y) {
                dash(a, b, travelled + (a - pair[0]).norm(), pen.dash, &mut segments);
            }
            travelled += (pair[1] - pair[0]).norm();
        }
    }
    let mut path = PathBuilder::new();
    let mut end = None;
    for &(a, b) in &segments {
        if end != Some(a) {
            path.move_to(a.x as f32, a.y as f32);
        }
        path.line_to(b.x as f32, b.y as f32);
        end = Some(b);
    }
    let line =
        Stroke { width: pen.width as f32, line_cap: LineCap::Round, line_join: LineJoin::Round, ..Stroke::default() };
    if let Some(outline) = path.finish().and_then(|path| path.stroke(&line, 1.0)) {
        fill(image, outline, FillRule::Winding, pen.color, opacity);
    }
}

pub(super) fn is_finite(point: &Point2<f64>) -> bool {
    point.x.is_finite() && point.y.is_finite()
}

/// Clips a segment to a rectangle (Liang and Barsky).
fn clip(
    a: Point2<f64>,
    b: Point2<f64>,
    x_low: f64,
    x_high: f64,
    y_low: f64,
    y_high: f64,
) -> Option<(Point2<f64>, Point2<f64>)> {
    let direction = b - a;
    let (mut enter, mut leave) = (0.0f64, 1.0f64);
    for (step, room_low, room_high) in
        [(direction.x, x_low - a.x, x_high - a.x), (direction.y, y_low - a.y, y_high - a.y)]
    {
        if step == 0.0 {
            if room_low > 0.0 || room_high < 0.0 {
                return None;
            }
            continue;
        }
        let (first, second) = (room_low / step, room_high / step);
        enter = enter.max(first.min(second));
        leave = leave.min(first.max(second));
    }
    (enter <= leave).then(|| (a + direction * enter, a + direction * leave))
}

/// Appends the dashes of a segment whose start is `travelled` pixels along its path.
fn dash(
    a: Point2<f64>,
    b: Point2<f64>,
    travelled: f64,
    pattern: Option<(f64, f64)>,
    segments: &mut Vec<(Point2<f64>, Point2<f64>)>,
) {
    let length = (b - a).norm();
    // A pattern below half a pixel would at best be grey, and a period of zero would never end.
    let Some((on, off)) = pattern.filter(|&(on, off)| on >= 0.5 && off >= 0.5 && length > 0.0) else {
        segments.push((a, b));
        return;
    };
    let period = on + off;
    let mut start = -(travelled % period);
    while start < length {
        let (from, to) = (start.max(0.0), (start + on).min(length));
        if from < to {
            segments.push((a + (b - a) * (from / length), a + (b - a) * (to / length)));
        }
        start += period;
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn clipping_keeps_the_inside() {
        let p = Point2::new;
        let (a, b) = clip(p(-10.0, 5.0), p(20.0, 5.0), 0.0, 10.0, 0.0, 10.0).unwrap();
        assert_eq!((a, b), (p(0.0, 5.0), p(10.0, 5.0)));
        assert!(clip(p(-1.0, -5.0), p(20.0, -5.0), 0.0, 10.0, 0.0, 10.0).is_none());
        assert!(clip(p(-5.0, 2.0), p(2.0, -5.0), 0.0, 10.0, 0.0, 10.0).is_none());
    }

    #[test]
    fn dashes_go_on_round_a_corner() {
        let p = Point2::new;
        let mut segments = Vec::new();
        dash(p(0.0, 0.0), p(7.0, 0.0), 0.0, Some((4.0, 2.0)), &mut segments);
        dash(p(7.0, 0.0), p(7.0, 6.0), 7.0, Some((4.0, 2.0)), &mut segments);
        let lengths: Vec<f64> = segments.iter().map(|(a, b)| (b - a).norm()).collect();
        // 4 on, 2 off, 1 on | 3 on, 2 off, 1 on
        assert_eq!(lengths, [4.0, 1.0, 3.0, 1.0]);
    }

    #[test]
    fn a_hundred_million_pixels_of_dashes_take_no_time() {
        let mut image = RgbImage::new(32, 32);
        let pen = Pen::new(Color::GRASP).dashed(3.0, 3.0);
        stroke(&mut image, &[vec![Point2::new(-1e8, 16.0), Point2::new(1e8, 16.0)]], &pen);
        assert!(image.get_pixel(16, 16).0 != [0, 0, 0] || image.get_pixel(20, 16).0 != [0, 0, 0]);
    }
}
