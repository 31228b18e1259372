//! One click: in pixels of the photo, and in those of the picture that is cut.

use nalgebra::Point2;

/// A place of the photo that a person clicked where a proposed outline was wrong.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OutlineClick {
    /// In pixels of the photo.
    pub at: Point2<f64>,
    /// Whether it belongs to the part.
    pub is_inside: bool,
}

/// A click, in pixels of the frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Click {
    pub x: usize,
    pub y: usize,
    pub is_inside: bool,
}

impl Click {
    /// From the middle of a pixel of a picture so wide, in pixels.
    pub(crate) fn distance(&self, at: usize, width: usize) -> f64 {
        ((at % width).abs_diff(self.x) as f64).hypot((at / width).abs_diff(self.y) as f64)
    }
}
