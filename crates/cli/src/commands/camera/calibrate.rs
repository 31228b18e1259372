//! `sdg camera calibrate`.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, anyhow, bail};
use clap::Args;
use rayon::prelude::*;
use sdg_calibration::{Board, CalibratedCamera, Calibration, CalibrationConfig, SeenCorner, calibrate, find_board};
use sdg_demonstration::PixelFrame;
use sdg_geometry::PinholeCamera;
use serde_json::{Value, json};

use super::board_in_use::{BoardInUse, grey, named};
use super::taking::{Seen, TakingArgs};
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

/// Maximum size of a camera file.
const MAX_BYTES: u64 = 1 << 20;

/// Calibrates the camera and writes its file.
pub fn run(args: &CalibrateArgs) -> Result<Outcome> {
    let board = args.board.read()?;
    sdg_files::check_writable(&args.out)?;
    check_updatable(&args.out)?;
    let config = |(width, height)| CalibrationConfig { width, height, has_k3: args.k3 };
    let mut lines: Vec<Value> = Vec::new();
    let mut seen = match args.live.address(&args.pictures)? {
        Some(address) => args.live.take(address, &board, config)?,
        None => Vec::new(),
    };
    let looked: Vec<(&Path, Result<Seen>)> =
        args.pictures.par_iter().map(|path| (path.as_path(), look(path, &board))).collect();
    for (path, result) in looked {
        match result {
            Ok(found) => seen.push(found),
            Err(error) => {
                let error = one_line(&error);
                eprintln!("left out: {error}");
                lines.push(json!({"picture": named(path), "error": error}));
            }
        }
    }
    let Some(first) = seen.first() else {
        if args.pictures.is_empty() {
            bail!("expected pictures of the board, found none: the board was never at rest in a frame");
        }
        bail!("expected pictures that show the board, found none among {}", args.pictures.len());
    };
    let (size, first) = (first.size, first.path.as_path());
    if let Some(other) = seen.iter().find(|other| other.size != size) {
        bail!(
            "{}: expected pictures of the same size: {} x {} as {}, found {} x {}",
            other.path.display(),
            size.0,
            size.1,
            first.display(),
            other.size.0,
            other.size.1
        );
    }
    warn_of_squares(&board, &seen);
    let corners: Vec<Vec<SeenCorner>> = seen.iter().map(|seen| seen.corners.clone()).collect();
    let found = calibrate(&board, &corners, &config(size))?;
    write_camera(args, &found)?;
    for (seen, fit) in seen.iter().zip(&found.pictures) {
        lines.push(json!({
            "picture": named(&seen.path), "corners": seen.corners.len(), "rms_px": fit.rms_px, "left_out": fit.is_left_out,
        }));
    }
    report(args, &found, &seen, lines)?;
    Ok(Outcome::Done)
}

fn look(path: &Path, board: &Board) -> Result<Seen> {
    let picture = sdg_inputs::read_image_in(path, PixelFrame::Sensor)?;
    let corners = find_board(&grey(&picture), board).with_context(|| named(path))?;
    Ok(Seen { path: path.to_owned(), size: picture.dimensions(), corners })
}

/// Warns if no picture shows all squares of the board: `--squares` may be wrong.
fn warn_of_squares(board: &Board, seen: &[Seen]) {
    let most = |axis: usize| {
        let corners = seen.iter().flat_map(|seen| &seen.corners);
        corners.map(|seen| seen.corner[axis]).max().unwrap_or_default() + 1
    };
    let (columns, rows) = (most(0), most(1));
    if (columns, rows) != (board.columns(), board.rows()) {
        eprintln!(
            "no picture shows more than {columns} x {rows} squares of {} x {}: check --squares",
            board.columns(),
            board.rows()
        );
    }
}

/// Fails before any picture is taken if the existing file cannot be updated. The file is not registered as an input: it
/// is read again when it is written.
fn check_updatable(path: &Path) -> Result<()> {
    let Ok(text) = fs::read_to_string(path) else { return Ok(()) };
    let intrinsics = PinholeCamera::symmetric(640, 480, 500.0);
    let any = CalibratedCamera { name: "camera".to_owned(), intrinsics, table: None, flange_from_camera: None };
    if !text.trim().is_empty() {
        any.update_yaml(&text).with_context(|| named(path))?;
    }
    Ok(())
}

fn write_camera(args: &CalibrateArgs, found: &Calibration) -> Result<()> {
    // The board and the pictures are inputs, which must not be replaced; the camera file itself may be updated.
    sdg_files::check_writable(&args.out)?;
    let existing = match fs::exists(&args.out) {
        Ok(true) => String::from_utf8(sdg_files::read(&args.out, MAX_BYTES)?)
            .map_err(|_| anyhow!("{}: expected YAML, found bytes that are not text", args.out.display()))?,
        _ => String::new(),
    };
    let old = CalibratedCamera::from_yaml(&existing).ok();
    if old.as_ref().is_some_and(|old| old.table.is_some() || old.flange_from_camera.is_some()) {
        eprintln!(
            "{}: the camera's pose was measured with the old calibration and is removed: run table or hand-eye again",
            args.out.display()
        );
    }
    let name = args.camera_name.clone().or(old.map(|old| old.name)).unwrap_or_else(|| "camera".to_owned());
    let camera = CalibratedCamera { name, intrinsics: found.camera, table: None, flange_from_camera: None };
    let text = if existing.trim().is_empty() {
        camera.to_yaml()
    } else {
        camera.update_yaml(&existing).with_context(|| named(&args.out))?
    };
    Ok(sdg_files::extend(&args.out, Some(&args.out), text.as_bytes())?)
}

fn report(args: &CalibrateArgs, found: &Calibration, seen: &[Seen], lines: Vec<Value>) -> Result<()> {
    let mut stdout = std::io::stdout().lock();
    let advice: Vec<String> = found.advice.iter().map(ToString::to_string).collect();
    if args.json {
        let by_name = |values: &[f64]| {
            Calibration::NAMES.into_iter().map(str::to_owned).zip(values.iter().map(|v| json!(v))).collect::<Value>()
        };
        let object = json!({
            "out": named(&args.out), "width": found.camera.width, "height": found.camera.height,
            "intrinsics": by_name(&found.values()), "sigma": by_name(&found.sigma), "rms_px": found.rms_px,
            "pictures": lines, "advice": advice,
        });
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
    for advice in advice {
        writeln!(stdout, "next: {advice}")?;
    }
    Ok(())
}
