//! A corner with its position on the board.

use nalgebra::Point2;

/// A corner of the board and its position in the picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SeenCorner {
    /// The indices of the corner, as in [`Board::corner`](crate::Board::corner).
    pub corner: [u32; 2],
    /// The position in the picture, in pixels.
    pub pixel: Point2<f64>,
}
