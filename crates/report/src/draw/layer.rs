//! Coverage of pixels by strokes and fills, painted in one go.
//!
//! A path's segments are joined in the coverage (the largest counts), not in the picture, so that joints and
//! crossings of a translucent path do not show twice.

use image::RgbImage;
use nalgebra::Point2;

use super::{Color, Pen};

/// Share of each pixel, in a rectangle of the picture, that a shape covers.
pub(super) struct Layer {
    x0: u32,
    y0: u32,
    width: u32,
    height: u32,
    coverage: Vec<f32>,
}

impl Layer {
    /// An empty layer over the part of the picture that the points, widened by `margin`, span; `None` when that
    /// is nothing.
    pub(super) fn around(image: &RgbImage, points: impl IntoIterator<Item = Point2<f64>>, margin: f64) -> Option<Self> {
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for point in points.into_iter().filter(is_finite) {
            for axis in 0..2 {
                low[axis] = low[axis].min(point[axis] - margin);
                high[axis] = high[axis].max(point[axis] + margin);
            }
        }
        // Float to integer casts saturate: what lies left of or above the picture becomes 0.
        let (x0, y0) = (low[0].floor() as u32, low[1].floor() as u32);
        let x1 = (high[0].ceil().max(0.0) as u32).min(image.width());
        let y1 = (high[1].ceil().max(0.0) as u32).min(image.height());
        if x0 >= x1 || y0 >= y1 {
            return None;
        }
        let (width, height) = (x1 - x0, y1 - y0);
        Some(Self { x0, y0, width, height, coverage: vec![0.0; width as usize * height as usize] })
    }

    /// Joins a segment with round ends.
    pub(super) fn add_segment(&mut self, a: Point2<f64>, b: Point2<f64>, width: f64) {
        let reach = 0.5 * width + 0.5;
        let direction = b - a;
        let length_squared = direction.norm_squared();
        self.update(a.x.min(b.x) - reach, a.x.max(b.x) + reach, a.y.min(b.y) - reach, a.y.max(b.y) + reach, |p| {
            let along =
                if length_squared > 0.0 { ((p - a).dot(&direction) / length_squared).clamp(0.0, 1.0) } else { 0.0 };
            reach - (p - (a + direction * along)).norm()
        });
    }

    /// Joins the inside of a convex polygon given in either sense; edges are antialiased.
    pub(super) fn add_convex(&mut self, corners: &[Point2<f64>]) {
        let count = corners.len();
        let area: f64 = (0..count).map(|i| corners[i].coords.perp(&corners[(i + 1) % count].coords)).sum();
        let sense = if area < 0.0 { -1.0 } else { 1.0 };
        let fold =
            |axis: usize, pick: fn(f64, f64) -> f64, start: f64| corners.iter().map(|c| c[axis]).fold(start, pick);
        let (x_low, x_high) = (fold(0, f64::min, f64::INFINITY), fold(0, f64::max, f64::NEG_INFINITY));
        let (y_low, y_high) = (fold(1, f64::min, f64::INFINITY), fold(1, f64::max, f64::NEG_INFINITY));
        self.update(x_low - 0.5, x_high + 0.5, y_low - 0.5, y_high + 0.5, |p| {
            (0..count)
                .map(|i| {
                    let (a, b) = (corners[i], corners[(i + 1) % count]);
                    let edge = b - a;
                    let length = edge.norm();
                    if length > 0.0 { sense * edge.perp(&(p - a)) / length } else { f64::INFINITY }
                })
                .fold(f64::INFINITY, f64::min)
                + 0.5
        });
    }

    /// Joins every pixel whose centre the predicate takes.
    pub(super) fn add_where(&mut self, contains: impl Fn(Point2<f64>) -> bool) {
        let (x1, y1) = (f64::from(self.x0 + self.width), f64::from(self.y0 + self.height));
        self.update(f64::from(self.x0), x1, f64::from(self.y0), y1, |p| f64::from(u8::from(contains(p))));
    }

    /// Mixes the colour into the picture by coverage times opacity.
    pub(super) fn paint(&self, image: &mut RgbImage, color: Color, opacity: f64) {
        for row in 0..self.height {
            for column in 0..self.width {
                let share = self.coverage[(row * self.width + column) as usize] * opacity as f32;
                if share <= 0.0 {
                    continue;
                }
                let pixel = image.get_pixel_mut(self.x0 + column, self.y0 + row);
                for (channel, &wanted) in pixel.0.iter_mut().zip(&color.0) {
                    let mixed = f32::from(*channel) * (1.0 - share) + f32::from(wanted) * share;
                    *channel = mixed.round() as u8;
                }
            }
        }
    }

    fn update(&mut self, x_low: f64, x_high: f64, y_low: f64, y_high: f64, coverage_at: impl Fn(Point2<f64>) -> f64) {
        let columns = (x_low.floor() as u32).max(self.x0)..(x_high.ceil().max(0.0) as u32).min(self.x0 + self.width);
        let rows = (y_low.floor() as u32).max(self.y0)..(y_high.ceil().max(0.0) as u32).min(self.y0 + self.height);
        for y in rows {
            for x in columns.clone() {
                let center = Point2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
                let covered = coverage_at(center).clamp(0.0, 1.0) as f32;
                let cell = &mut self.coverage[((y - self.y0) * self.width + (x - self.x0)) as usize];
                *cell = cell.max(covered);
            }
        }
    }
}

/// Strokes polylines with a pen, its halo first.
pub(super) fn stroke(image: &mut RgbImage, polylines: &[Vec<Point2<f64>>], pen: &Pen) {
    if pen.halo {
        let rim = Pen { color: HALO_COLOR, width: pen.width + 2.0 * HALO_WIDTH, ..*pen };
        stroke_translucent(image, polylines, &rim, HALO_OPACITY);
    }
    stroke_translucent(image, polylines, pen, 1.0);
}

/// Strokes polylines with a pen and an opacity, without a halo.
pub(super) fn stroke_translucent(image: &mut RgbImage, polylines: &[Vec<Point2<f64>>], pen: &Pen, opacity: f64) {
    if !(pen.width.is_finite() && pen.width > 0.0) {
        return;
    }
    let reach = 0.5 * pen.width + 1.0;
    let (high_x, high_y) = (f64::from(image.width()) + reach, f64::from(image.height()) + reach);
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
    if let Some(mut layer) = Layer::around(image, segments.iter().flat_map(|&(a, b)| [a, b]), reach) {
        for &(a, b) in &segments {
            layer.add_segment(a, b, pen.width);
        }
        layer.paint(image, pen.color, opacity);
    }
}

/// Width of the dark rim on each side of a line, in pixels.
pub(super) const HALO_WIDTH: f64 = 1.0;
pub(super) const HALO_COLOR: Color = Color([12, 14, 18]);
pub(super) const HALO_OPACITY: f64 = 0.45;

pub(super) fn is_finite(point: &Point2<f64>) -> bool {
    point.x.is_finite() && point.y.is_finite()
}

/// The part of a segment inside a rectangle, by Liang and Barsky.
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

/// Appends the dashes of a segment whose start lies `travelled` pixels along its path.
fn dash(
    a: Point2<f64>,
    b: Point2<f64>,
    travelled: f64,
    pattern: Option<(f64, f64)>,
    segments: &mut Vec<(Point2<f64>, Point2<f64>)>,
) {
    let length = (b - a).norm();
    // Below half a pixel a pattern is grey at best; a period of zero would never end.
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
