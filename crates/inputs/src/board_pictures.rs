//! Pictures of a board, for calibrations.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use rayon::prelude::*;
use sdg_calibration::{Board, CalibratedCamera, SeenCorner, Sheet, find_board};
use sdg_demonstration::PixelFrame;

use crate::pictures::read_image_in;

/// Maximum size of a board file; a drawn [`Sheet`] is smaller.
const MAX_BOARD_BYTES: u64 = 4 << 20;

/// Reads the number and size of a board's squares from its SVG or PDF.
///
/// # Errors
/// The file cannot be read, or was not drawn by [`Sheet`].
pub fn read_board(path: &Path) -> Result<Board> {
    let bytes = sdg_files::read(path, MAX_BOARD_BYTES)?;
    Sheet::board_of(&String::from_utf8_lossy(&bytes)).with_context(|| path.display().to_string())
}

/// A picture in which the board was found.
#[derive(Debug, Clone)]
pub struct BoardPicture {
    /// The file.
    pub path: PathBuf,
    /// Width and height.
    pub size: (u32, u32),
    /// The board's corners.
    pub corners: Vec<SeenCorner>,
}

impl BoardPicture {
    /// Reads a picture and finds the board in it.
    ///
    /// # Errors
    /// The file cannot be read, its size is not that of the `camera`, or no such board is visible.
    pub fn read(path: &Path, board: &Board, camera: Option<&CalibratedCamera>) -> Result<Self> {
        let named = || path.display().to_string();
        let picture = read_image_in(path, PixelFrame::Sensor)?;
        let size = picture.dimensions();
        if let Some(camera) = camera {
            camera.check_picture(size).with_context(named)?;
        }
        let corners = find_board(&image::imageops::grayscale(&picture), board).with_context(named)?;
        Ok(Self { path: path.to_owned(), size, corners })
    }

    /// Reads pictures in parallel, in order.
    pub fn read_all<'a>(paths: &'a [PathBuf], board: &Board) -> Vec<(&'a Path, Result<Self>)> {
        paths.par_iter().map(|path| (path.as_path(), Self::read(path, board, None))).collect()
    }

    /// The size of all pictures; `None` without pictures.
    ///
    /// # Errors
    /// A picture has another size than the first one.
    pub fn common_size(pictures: &[Self]) -> Result<Option<(u32, u32)>> {
        let Some(first) = pictures.first() else { return Ok(None) };
        if let Some(other) = pictures.iter().find(|other| other.size != first.size) {
            bail!(
                "{}: expected pictures of the same size: {} x {} as {}, found {} x {}",
                other.path.display(),
                first.size.0,
                first.size.1,
                first.path.display(),
                other.size.0,
                other.size.1
            );
        }
        Ok(Some(first.size))
    }

    /// The largest numbers of columns and rows of squares that are visible in any of the pictures.
    pub fn most_squares(pictures: &[Self]) -> (u32, u32) {
        let most = |axis: usize| {
            let corners = pictures.iter().flat_map(|seen| &seen.corners);
            corners.map(|seen| seen.corner[axis]).max().unwrap_or_default() + 1
        };
        (most(0), most(1))
    }
}
