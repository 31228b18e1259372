//! Finds the board in a picture: corners with subpixel accuracy, each with its position on the board.
//!
//! ```text
//! picture ─ halved step by step ─ saddle points ─ grid grown from neighbour to neighbour        saddle.rs, grid.rs
//!         ─ dots read: position and rotation on the board ─ corners refined at full resolution  dots.rs, refine.rs
//!         ─ rejected if the corners are not in a plane or brightness varies within squares      acceptance.rs
//! ```
//! A grid is extended from its last steps, so that distortion and perspective need not be known. The first pixel's
//! centre is at (0.5, 0.5).

mod acceptance;
mod dots;
mod grid;
mod luminance;
mod refine;
mod saddle;
mod seen_corner;

use image::GrayImage;

use self::grid::Grid;
use self::luminance::Luminance;
pub use self::seen_corner::SeenCorner;
use crate::board::Board;
use crate::error::CalibrationError;

/// Minimum number of corners of a usable board: three by three.
pub const MIN_CORNERS: usize = 9;
/// Pictures are halved as long as their longer side stays at least this, and both sides have a pixel: corners of a
/// blurred picture are only found at low resolution.
const MIN_SIDE: u32 = 160;
/// Pictures with a longer side above this are halved before the first search.
const MAX_SIDE: u32 = 2000;

/// Finds the board, which may be partly outside the picture.
///
/// # Units and frames
/// Pixels with the first centre at (0.5, 0.5); corners in [`Board`]'s order, row by row.
///
/// # Errors
/// [`CalibrationError::BoardNotFound`], [`CalibrationError::BoardUnclear`], [`CalibrationError::OtherBoard`],
/// [`CalibrationError::OtherCheckerboard`].
pub fn find_board(picture: &GrayImage, board: &Board) -> Result<Vec<SeenCorner>, CalibrationError> {
    let full = Luminance::of(picture);
    let mut level = full.clone();
    let mut scale = 1.0;
    while level.longer_side() > MAX_SIDE && level.can_be_halved() {
        level = level.halved();
        scale *= 2.0;
    }
    let mut largest = Grid::default();
    let mut refusal = None;
    let mut found: Vec<SeenCorner> = Vec::new();
    loop {
        for grid in grid::grow_all(&saddle::find(&level)) {
            if grid.len() > largest.len() {
                largest = grid.clone();
            }
            if grid.len() < MIN_CORNERS || grid.len() <= found.len() {
                continue;
            }
            match dots::identify(&level, &grid, board) {
                Ok(placed) => {
                    let corners = refine::refine(&full, &grid.scaled(scale), &placed);
                    if !acceptance::is_board(&full, &corners) {
                        refusal = refusal.or(Some(CalibrationError::BoardUnclear { corners: grid.len() }));
                    } else if corners.len() > found.len() {
                        found = corners;
                    }
                }
                // The error of the first sufficiently large grid is kept: later grids are not larger, or have a lower
                // resolution.
                Err(error) => refusal = refusal.or(Some(error)),
            }
        }
        if found.len() == board.num_corners() || level.longer_side() < 2 * MIN_SIDE || !level.can_be_halved() {
            break;
        }
        level = level.halved();
        scale *= 2.0;
    }
    if found.len() >= MIN_CORNERS {
        found.sort_by_key(|seen| (seen.corner[1], seen.corner[0]));
        return Ok(found);
    }
    let [columns, rows] = largest.extent();
    Err(refusal.unwrap_or(CalibrationError::BoardNotFound { corners: largest.len(), columns, rows }))
}
