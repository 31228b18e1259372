//! The board in the pictures: read from its file or given by its numbers, with the measured length of its ruler line.

use std::path::{Path, PathBuf};

use anyhow::Result;
use clap::Args;
use sdg_calibration::Board;

use crate::exit::Usage;

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
    /// Measured length of the line that is 100 mm long in the drawing; printers may change the scale
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
            Some(path) => sdg_inputs::read_board(path)?,
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

/// A path as shown in messages.
pub fn named(path: &Path) -> String {
    path.display().to_string()
}
