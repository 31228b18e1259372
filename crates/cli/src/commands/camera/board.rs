//! `sdg camera board`.

use std::io::Write;
use std::path::PathBuf;

use anyhow::Result;
use clap::{Args, ValueEnum};
use sdg_calibration::{Board, Paper, Sheet};

use super::board_in_use::squares;
use crate::exit::{Outcome, Usage};
use crate::output_paths::check_ending;

/// `sdg camera board`
#[derive(Debug, Args)]
pub struct BoardArgs {
    /// The SVG file to write
    #[arg(long, default_value = "board.svg", value_name = "FILE")]
    out: PathBuf,
    /// Also write the sheet as PDF to this file
    #[arg(long, value_name = "FILE")]
    pdf: Option<PathBuf>,
    /// Number of squares, horizontally and vertically
    #[arg(long, default_value = "9x6", value_name = "WxH", value_parser = squares)]
    squares: [u32; 2],
    /// Side of a square in millimetres; default: the largest multiple of 5 mm that fits on the paper
    #[arg(long, value_name = "MM")]
    square_mm: Option<f64>,
    /// Paper size
    #[arg(long, default_value = "a4", value_name = "PAPER")]
    paper: PaperName,
}

/// Names of [`Paper`].
#[derive(Debug, Clone, Copy, ValueEnum)]
enum PaperName {
    A4,
    A3,
    Letter,
}

impl From<PaperName> for Paper {
    fn from(name: PaperName) -> Self {
        match name {
            PaperName::A4 => Self::A4,
            PaperName::A3 => Self::A3,
            PaperName::Letter => Self::Letter,
        }
    }
}

/// Writes the sheet.
pub fn run(args: &BoardArgs) -> Result<Outcome> {
    check_ending("--out", &args.out, "svg")?;
    args.pdf.as_deref().map_or(Ok(()), |pdf| check_ending("--pdf", pdf, "pdf"))?;
    let (paper, [columns, rows]) = (Paper::from(args.paper), args.squares);
    let laid_out = || {
        let square_m = match args.square_mm {
            Some(millimetres) => millimetres / 1000.0,
            None => Sheet::square_m_that_fits(columns, rows, paper)?,
        };
        Sheet::new(Board::new(columns, rows, square_m)?, paper).map(|sheet| (sheet, 1000.0 * square_m))
    };
    let (sheet, square_mm) = laid_out().map_err(|error| Usage(error.to_string()))?;
    sdg_files::write(&args.out, sheet.to_svg().as_bytes())?;
    if let Some(pdf) = &args.pdf {
        sdg_files::write(pdf, &sheet.to_pdf())?;
    }
    let mut stdout = std::io::stdout().lock();
    writeln!(stdout, "{}: {columns} x {rows} squares of {square_mm} mm on {}", args.out.display(), paper.name())?;
    writeln!(stdout, "Print it at 100 %, glue it to something flat, and measure the 100 mm line: --measured-mm")?;
    Ok(Outcome::Done)
}
