//! `sdg camera calibrate`.

use std::io::Write;
use std::path::PathBuf;

use anyhow::{Result, bail};
use clap::Args;
use sdg_calibration::{Board, Calibration, CalibrationConfig, SeenCorner, calibrate};
use sdg_inputs::{BoardPicture, CameraUpdate};
use serde_json::{Value, json};

use super::board_in_use::{BoardInUse, named};
use super::taking::TakingArgs;
use crate::exit::{Outcome, one_line};

/// `sdg camera calibrate`
#[derive(Debug, Args)]
pub struct CalibrateArgs {
    /// Pictures of the board, PNG or JPEG: 10 to 20, tilted by 20 to 40 degrees in all directions, with the board in
    /// every part of the picture
    #[arg(required_unless_present = "from", value_name = "PICTURE")]
    pictures: Vec<PathBuf>,
    #[command(flatten)]
    board: BoardInUse,
    /// The camera's name in its file; default: the name in the existing file, or `camera`
    #[arg(long, value_name = "NAME")]
    camera_name: Option<String>,
    /// Also estimate k3: for wide-angle lenses and at least 20 pictures
    #[arg(long)]
    k3: bool,
    /// The camera file to write; comments and unknown fields of an existing file are kept
    #[arg(long, default_value = "camera.yaml", value_name = "FILE")]
    out: PathBuf,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
    // Flattened last, because its help heading applies to all options after it.
    #[command(flatten)]
    live: TakingArgs,
}

/// Calibrates the camera and writes its file.
pub fn run(args: &CalibrateArgs) -> Result<Outcome> {
    let board = args.board.read()?;
    args.pictures.iter().for_each(|path| sdg_files::keep(path));
    CameraUpdate::check(&args.out)?;
    let config = |(width, height)| CalibrationConfig { width, height, has_k3: args.k3 };
    let mut lines: Vec<Value> = Vec::new();
    let mut seen = match args.live.address(&args.pictures)? {
        Some(address) => args.live.take(address, &board, config)?,
        None => Vec::new(),
    };
    for (path, result) in BoardPicture::read_all(&args.pictures, &board) {
        match result {
            Ok(found) => seen.push(found),
            Err(error) => {
                let error = one_line(&error);
                eprintln!("left out: {error}");
                lines.push(json!({"picture": named(path), "error": error}));
            }
        }
    }
    let Some(size) = BoardPicture::common_size(&seen)? else {
        if args.pictures.is_empty() {
            bail!("expected pictures of the board, found none: the board was never at rest in a frame");
        }
        bail!("expected pictures that show the board, found none among {}", args.pictures.len());
    };
    warn_of_squares(&board, &seen);
    let corners: Vec<Vec<SeenCorner>> = seen.iter().map(|seen| seen.corners.clone()).collect();
    let found = calibrate(&board, &corners, &config(size))?;
    let update = CameraUpdate::read(&args.out)?;
    let removes_pose = update.removes_pose();
    update.write(found.camera, args.camera_name.clone())?;
    if removes_pose {
        eprintln!(
            "{}: the camera's pose was measured with the old calibration and is removed: run table or hand-eye again",
            args.out.display()
        );
    }
    for (seen, fit) in seen.iter().zip(&found.pictures) {
        lines.push(json!({
            "picture": named(&seen.path), "corners": seen.corners.len(), "rms_px": fit.rms_px, "left_out": fit.is_left_out,
        }));
    }
    report(args, &found, &seen, lines)?;
    Ok(Outcome::Done)
}

/// Warns if the pictures show fewer columns or rows of squares than the given board has: they may show another board.
fn warn_of_squares(board: &Board, seen: &[BoardPicture]) {
    let (columns, rows) = BoardPicture::most_squares(seen);
    if (columns, rows) != (board.columns(), board.rows()) {
        eprintln!(
            "no picture shows more than {columns} x {rows} squares of {} x {}: check the given board (--squares or --board)",
            board.columns(),
            board.rows()
        );
    }
}

fn report(args: &CalibrateArgs, found: &Calibration, seen: &[BoardPicture], lines: Vec<Value>) -> Result<()> {
    let mut stdout = std::io::stdout().lock();
    if args.json {
        let mut object = found.to_json();
        object["out"] = json!(named(&args.out));
        object["pictures"] = json!(lines);
        writeln!(stdout, "{object}")?;
        return Ok(());
    }
    let used = found.pictures.iter().filter(|fit| !fit.is_left_out).count();
    writeln!(
        stdout,
        "{}: {} x {} px, reprojection {:.3} px RMS over {used} pictures",
        args.out.display(),
        found.camera.width,
        found.camera.height,
        found.rms_px
    )?;
    for ((name, value), sigma) in Calibration::NAMES.into_iter().zip(found.values()).zip(found.sigma) {
        let digits = if name.starts_with(['f', 'c']) { 2 } else { 5 };
        if sigma > 0.0 {
            writeln!(stdout, "  {name} {value:.digits$} ± {sigma:.digits$}")?;
        }
    }
    for (seen, fit) in seen.iter().zip(&found.pictures) {
        let left_out = if fit.is_left_out { ", left out: it disagrees with the others" } else { "" };
        writeln!(stdout, "  {}: {} corners, {:.3} px{left_out}", seen.path.display(), seen.corners.len(), fit.rms_px)?;
    }
    for advice in &found.advice {
        writeln!(stdout, "next: {advice}")?;
    }
    Ok(())
}
