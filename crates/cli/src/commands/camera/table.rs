//! `sdg camera table`.

use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use clap::Args;
use nalgebra::Vector3;
use sdg_calibration::{
    ASSUMED_VIEW_DEG, CalibratedCamera, FocalCost, FocalSource, Frame, SheetPlacement, SheetPose, UNCALIBRATED,
    bent_px, focal_cost, guess_camera, locate_sheet, pose_json,
};
use sdg_cell::without_minus_zero;
use sdg_inputs::{BoardPicture, camera_files};
use serde_json::{Value, json};

use super::board_in_use::{BoardInUse, named};
use crate::exit::{Outcome, Usage};
use crate::shared_args::{METRES, height_mm, table_height_mm};

/// `sdg camera table`
#[derive(Debug, Args)]
pub struct TableArgs {
    /// One picture of the sheet on the table
    #[arg(value_name = "PICTURE")]
    picture: PathBuf,
    /// The camera file from `sdg camera calibrate`; without it, the focal length is estimated and no lens distortion is
    /// assumed
    #[arg(long, value_name = "FILE")]
    camera: Option<PathBuf>,
    #[command(flatten)]
    board: BoardInUse,
    /// The sheet's origin (the outer corner above the text at its lower left) in the robot's base; without it, poses
    /// are in the sheet's frame
    #[arg(
        long,
        value_name = "X,Y",
        value_delimiter = ',',
        num_args = 1,
        allow_negative_numbers = true,
        allow_hyphen_values = true
    )]
    sheet_in_base_mm: Vec<f64>,
    /// Direction of the sheet's x axis in the robot's base: rotation about z
    #[arg(
        long,
        default_value_t = 0.0,
        hide_default_value = true,
        value_name = "DEG",
        requires = "sheet_in_base_mm",
        allow_hyphen_values = true
    )]
    sheet_yaw_deg: f64,
    /// The table's z in the robot's base
    #[arg(
        long,
        default_value_t = 0.0,
        hide_default_value = true,
        value_name = "MM",
        requires = "sheet_in_base_mm",
        allow_hyphen_values = true,
        value_parser = table_height_mm
    )]
    table_height_mm: f64,
    /// Height of the sheet's upper side above the table, if the sheet is on a plate
    #[arg(long, default_value_t = 0.0, hide_default_value = true, value_name = "MM", value_parser = height_mm)]
    sheet_thickness_mm: f64,
    /// Height of a part's marks at which the error caused by a wrong focal length is reported
    #[arg(long, default_value_t = 30.0, value_name = "MM", value_parser = height_mm)]
    mark_height_mm: f64,
    /// Focal length in pixels, for a camera without a file
    #[arg(long, value_name = "PX", conflicts_with = "camera")]
    focal_px: Option<f64>,
    /// The file to write, with `table:`; default: the camera file. Without --camera, an existing file is updated only
    /// if its camera was estimated
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

/// Relative error of the focal length whose effect is reported.
const FOCAL_ERROR: f64 = 0.1;
/// Maximum absolute value of a length in the arguments, such as the distance from the robot's base to the sheet.
const MAX_REACH_MM: f64 = 5000.0;

/// Finds the camera's pose above the sheet and writes it into a camera file.
pub fn run(args: &TableArgs) -> Result<Outcome> {
    let board = args.board.read()?;
    let placement = placement(args)?;
    let existing = args.camera.as_deref().map(camera_files::read).transpose()?;
    let Some(out) = args.out.as_ref().or(args.camera.as_ref()) else {
        return Err(Usage("expected --out FILE, or --camera FILE to write the table's pose into".to_owned()).into());
    };
    sdg_files::check_extendable(out, args.camera.as_deref())?;
    let estimate = if existing.is_none() { estimate_in(out)? } else { None };
    let camera_in_use = existing.as_ref().map(|(camera, _)| camera);
    let BoardPicture { size, corners, .. } = BoardPicture::read(&args.picture, &board, camera_in_use)?;
    let (camera, source) = match &existing {
        Some((camera, _)) => (camera.clone(), FocalSource::File),
        None => {
            let guessed = guess_camera(size, &board, &corners, args.focal_px);
            let Some((camera, source)) = guessed else {
                bail!("expected --focal-px of some pixels, found {}", args.focal_px.unwrap_or_default());
            };
            if let Some(rms) = bent_px(&board, &corners) {
                eprintln!("the sheet's lines are bent by {rms:.1} px RMS: calibrate the lens (sdg camera calibrate)");
            }
            // An earlier estimate may have a workspace.
            let table = estimate.as_ref().and_then(|(old, _)| old.table.clone());
            (CalibratedCamera { table, ..camera }, source)
        }
    };
    let sheet = locate_sheet(&camera.intrinsics, &board, &corners).with_context(|| named(&args.picture))?;
    let camera = placement.place(camera, &sheet);
    let text = match existing.as_ref().or(estimate.as_ref()) {
        Some((_, text)) => camera.update_yaml(text).with_context(|| named(out))?,
        None => camera.to_yaml(),
    };
    // Check here what `detect --camera` would reject later.
    CalibratedCamera::from_yaml(&text).with_context(|| named(&args.picture))?;
    let cost = focal_cost(&camera.intrinsics, &board, &corners, args.mark_height_mm / 1000.0, FOCAL_ERROR)?;
    sdg_files::extend(out, args.camera.as_deref(), text.as_bytes())?;
    if estimate.is_some_and(|(old, _)| old.flange_from_camera.is_some()) {
        eprintln!(
            "{}: the camera's pose on the hand was measured with the old estimate and is removed: run hand-eye again",
            out.display()
        );
    }
    report(args, out, &camera, &sheet, &source, &cost, corners.len())?;
    Ok(Outcome::Done)
}

/// The estimated camera in an existing file, which another estimate updates, and the file's text. The file is not
/// registered as an input, because it may be replaced.
///
/// # Errors
/// The file contains something else: one that cannot be read may be that of a camera with another lens model.
fn estimate_in(out: &Path) -> Result<Option<(CalibratedCamera, String)>> {
    let bytes = std::fs::read(out).unwrap_or_default();
    let text = camera_files::text_of(out, bytes).map_err(|error| Usage(format!("--out: {error}")))?;
    if text.trim().is_empty() {
        return Ok(None);
    }
    let out = named(out);
    let refusal = match CalibratedCamera::from_yaml(&text) {
        Ok(camera) if camera.name == UNCALIBRATED => return Ok(Some((camera, text))),
        Ok(_) => format!("{out}: expected --camera {out}, which keeps its lens, or another --out"),
        Err(error) => format!("--out: expected a new file or that of an estimated camera, found {out}: {error}"),
    };
    Err(Usage(refusal).into())
}

/// The sheet's position and direction in the frame of the camera file.
fn placement(args: &TableArgs) -> Result<SheetPlacement> {
    let thickness = args.sheet_thickness_mm;
    let (frame, [x, y], height_mm) = match args.sheet_in_base_mm[..] {
        [] => (Frame::Table, [0.0, 0.0], 0.0),
        [x, y] => (Frame::Base, [x, y], args.table_height_mm),
        _ => return Err(Usage("expected --sheet-in-base-mm X,Y".to_owned()).into()),
    };
    let values = [x, y, args.table_height_mm, thickness, args.mark_height_mm];
    if let Some(value) = values.into_iter().find(|value| !(-MAX_REACH_MM..=MAX_REACH_MM).contains(value)) {
        return Err(Usage(format!("expected lengths up to {MAX_REACH_MM} mm, found {value}")).into());
    }
    // Within reach as metres; as millimetres, the sheet would lie under the robot.
    if [x, y] != [0.0; 2] && [x, y].iter().all(|value| value.abs() <= 1e-3 * MAX_REACH_MM) {
        return Err(Usage(format!("--sheet-in-base-mm: expected X,Y in mm, found {x},{y}{METRES}")).into());
    }
    let yaw_deg = args.sheet_yaw_deg;
    if !(-360.0..=360.0).contains(&yaw_deg) {
        return Err(Usage(format!("--sheet-yaw-deg: expected -360 to 360 degrees, found {yaw_deg}")).into());
    }
    Ok(SheetPlacement {
        frame,
        origin_m: Vector3::new(x, y, args.table_height_mm + thickness) / 1000.0,
        yaw_rad: yaw_deg.to_radians(),
        table_height_m: height_mm / 1000.0,
    })
}

fn report(
    args: &TableArgs,
    out: &Path,
    camera: &CalibratedCamera,
    sheet: &SheetPose,
    source: &FocalSource,
    cost: &FocalCost,
    num_corners: usize,
) -> Result<()> {
    let mut stdout = std::io::stdout().lock();
    let focal = camera.intrinsics.fx;
    let place = camera.table.as_ref().map(|table| (table.frame.name(), table.frame_from_camera));
    let (frame, pose) = place.unwrap_or((Frame::Table.name(), sheet.sheet_from_camera));
    let [sigma_mm, sigma_deg] = [1000.0 * sheet.sigma_height_m, sheet.sigma_tilt_rad.to_degrees()];
    let costs = [cost.at_sheet_m, cost.at_border_m].map(|metres| 1000.0 * metres);
    if args.json {
        let sigma: Value = match source {
            FocalSource::Perspective(sigma) => json!(sigma * focal),
            _ => Value::Null,
        };
        let object = json!({
            "out": named(out), "frame": frame, "frame_from_camera": pose_json(&pose), "corners": num_corners, "rms_px": sheet.rms_px,
            "sigma_height_mm": sigma_mm, "sigma_tilt_deg": sigma_deg, "tilt_deg": sheet.tilt_rad.to_degrees(),
            "focal": {"px": focal, "source": source.name(), "sigma_px": sigma},
            "focal_cost": {
                "focal_error": cost.focal_error, "mark_height_mm": args.mark_height_mm,
                "at_sheet_mm": costs[0], "at_border_mm": costs[1],
            },
        });
        writeln!(stdout, "{object}")?;
        return Ok(());
    }
    let [x, y, z]: [f64; 3] = pose.translation.vector.map(|length| without_minus_zero(length * 1000.0, 1)).into();
    writeln!(
        stdout,
        "{}: camera at {frame} ({x:.1}, {y:.1}, {z:.1}) mm, {:.1} degrees from straight down",
        out.display(),
        sheet.tilt_rad.to_degrees()
    )?;
    writeln!(
        stdout,
        "  {num_corners} corners, {:.3} px RMS; height ± {sigma_mm:.2} mm, tilt ± {sigma_deg:.3} degrees",
        sheet.rms_px
    )?;
    match source {
        FocalSource::File => return Ok(()),
        FocalSource::Given => writeln!(stdout, "  focal length {focal:.0} px as given")?,
        FocalSource::Perspective(sigma) => {
            writeln!(stdout, "  focal length {focal:.0} px from the sheet's perspective, ± {:.0} %", 100.0 * sigma)?;
        }
        FocalSource::Guess => {
            writeln!(
                stdout,
                "  focal length {focal:.0} px assumed for a view of {ASSUMED_VIEW_DEG} degrees: the sheet is tilted too little to estimate it"
            )?;
        }
    }
    let [at_sheet, at_border] = costs.map(|cost_mm| match cost_mm.is_nan() {
        true => "an unknown error".to_owned(),
        false => format!("{cost_mm:.1} mm"),
    });
    writeln!(
        stdout,
        "  an error of 10 % in the focal length gives, {} mm above the sheet: {at_sheet} at the sheet, {at_border} at the picture's border",
        args.mark_height_mm
    )?;
    Ok(())
}
