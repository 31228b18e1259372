//! The board in the pictures: read from its file or given by its numbers, with the measured length of its ruler line.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use clap::Args;
use image::{GrayImage, RgbImage};
use nalgebra::Isometry3;
use sdg_calibration::{Board, Sheet};
use serde_json::{Value, json};

use crate::exit::Usage;

/// Maximum size of a board file; `sdg camera board` writes smaller ones.
const MAX_BYTES: u64 = 4 << 20;

/// The board in the pictures.
#[derive(Debug, Args)]
pub struct BoardInUse {
    /// The board's SVG or PDF, which contains the number and size of its squares
    #[arg(long, value_name = "FILE", conflicts_with_all = ["squares", "square_mm"])]
    board: Option<PathBuf>,
    /// Number of squares of the board, horizontally and vertically
    #[arg(long, default_value = "9x6", value_name = "WxH", value_parser = squares)]
    squares: [u32; 2],
    /// Side of a square as designed, in millimetres
    #[arg(long, default_value_t = 25.0, value_name = "MM")]
    square_mm: f64,
    /// Measured length of the printed 100 mm line; printers scale
    #[arg(long, default_value_t = 100.0, hide_default_value = true, value_name = "MM")]
    measured_mm: f64,
}

impl BoardInUse {
    /// Measured length of the printed 100 mm line, in millimetres.
    pub fn measured_mm(&self) -> f64 {
        self.measured_mm
    }

    /// The board with its printed size.
    pub fn read(&self) -> Result<Board> {
        let drawn = match &self.board {
            Some(path) => {
                let bytes = sdg_files::read(path, MAX_BYTES)?;
                Sheet::board_of(&String::from_utf8_lossy(&bytes)).with_context(|| path.display().to_string())?
            }
            None => {
                let [columns, rows] = self.squares;
                Board::new(columns, rows, self.square_mm / 1000.0).map_err(|error| Usage(error.to_string()))?
            }
        };
        Ok(drawn.as_printed(self.measured_mm).map_err(|error| Usage(error.to_string()))?)
    }
}

/// Parses `9x6`.
pub fn squares(text: &str) -> Result<[u32; 2], String> {
    let sides = text.split_once('x').and_then(|(columns, rows)| Some([columns.parse().ok()?, rows.parse().ok()?]));
    sides.ok_or_else(|| format!("expected squares horizontally and vertically, such as 9x6, found {text}"))
}

/// The picture in greyscale, as board detection needs it.
pub fn grey(picture: &RgbImage) -> GrayImage {
    image::imageops::grayscale(picture)
}

/// A pose in the format of camera files and `--json`.
pub fn pose_json(pose: &Isometry3<f64>) -> Value {
    let translation: [f64; 3] = pose.translation.vector.into();
    let rotation: [f64; 4] = pose.rotation.coords.into();
    json!({"translation_m": translation, "rotation_xyzw": rotation})
}

/// A path as shown in messages.
pub fn named(path: &Path) -> String {
    path.display().to_string()
}
