//! A corner with its place on the board.

use nalgebra::Point2;

/// A corner of the board and where the picture shows it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SeenCorner {
    /// Which corner, as [`Board::corner`] counts.
    pub corner: [u32; 2],
    /// Where it appears, in pixels.
    pub pixel: Point2<f64>,
}
