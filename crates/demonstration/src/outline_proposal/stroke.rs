//! One stroke: in pixels of the photo, and in those of the frame.

use nalgebra::Point2;

/// A line that a person drew over a wrong area of a proposed outline; a click is a line of one point.
#[derive(Debug, Clone, PartialEq)]
pub struct OutlineStroke {
    /// In pixels of the photo, in drawing order.
    pub points: Vec<Point2<f64>>,
    /// Whether the area under it belongs to the part.
    pub is_inside: bool,
}

impl OutlineStroke {
    /// A click.
    pub fn click(at: Point2<f64>, is_inside: bool) -> Self {
        Self { points: vec![at], is_inside }
    }
}

/// A stroke as pixels of the frame, without gaps.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Stroke {
    /// Indices of pixels, each once.
    pub pixels: Vec<usize>,
    pub is_inside: bool,
}

impl Stroke {
    /// The distance to the nearest pixel of the stroke, for every pixel of a picture of this size.
    pub(crate) fn distances(&self, width: usize, count: usize) -> Vec<f32> {
        let places: Vec<(f32, f32)> = self.pixels.iter().map(|at| ((at % width) as f32, (at / width) as f32)).collect();
        let nearest = |at: usize| {
            let (x, y) = ((at % width) as f32, (at / width) as f32);
            places.iter().map(|(sx, sy)| (x - sx).powi(2) + (y - sy).powi(2)).fold(f32::INFINITY, f32::min).sqrt()
        };
        (0..count).map(nearest).collect()
    }
}
