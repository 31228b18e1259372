//! `sdg camera hand-eye`.

use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, anyhow};
use clap::{Args, ValueEnum};
use sdg_calibration::{CalibrationError, HandEye, RobotPose, calibrate_hand_eye};
use sdg_cell::without_minus_zero;
use sdg_geometry::{Mount, upper_median};
use sdg_inputs::{camera_files, robot_poses};
use serde_json::{Value, json};

use super::board_in_use::{BoardInUse, named};
use crate::exit::{Outcome, Usage, one_line};
use crate::shared_args::table_height_mm;

/// `sdg camera hand-eye`
#[derive(Debug, Args)]
pub struct HandEyeArgs {
    /// The camera file from `sdg camera calibrate`
    #[arg(long, value_name = "FILE")]
    camera: PathBuf,
    /// Robot poses and the names of the pictures taken at them: YAML, JSON or CSV; the pictures are in FILE's folder
    #[arg(long, value_name = "FILE")]
    poses: PathBuf,
    /// Where the camera is mounted: on the robot's hand, or fixed relative to its base
    #[arg(long, value_name = "PLACE")]
    mount: MountName,
    #[command(flatten)]
    board: BoardInUse,
    /// The table's z in the robot's base, for a camera beside the robot; default: the value in the camera file, else 0
    #[arg(long, value_name = "MM", allow_hyphen_values = true, value_parser = table_height_mm)]
    table_height_mm: Option<f64>,
    /// The file to write, with the camera's pose; default: nothing is written
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

/// Names of [`Mount`].
#[derive(Debug, Clone, Copy, ValueEnum)]
enum MountName {
    Hand,
    Base,
}

impl From<MountName> for Mount {
    fn from(name: MountName) -> Self {
        match name {
            MountName::Hand => Self::Hand,
            MountName::Base => Self::Base,
        }
    }
}

/// Ratio of a picture's error to the median error above which the picture is reported.
const MAX_RMS_RATIO: f64 = 3.0;

/// Finds the pose of the camera on the robot's hand or beside the robot.
pub fn run(args: &HandEyeArgs) -> Result<Outcome> {
    let mount = Mount::from(args.mount);
    if args.table_height_mm.is_some() && mount == Mount::Hand {
        return Err(Usage("--table-height-mm: expected --mount base, found --mount hand".to_owned()).into());
    }
    let board = args.board.read()?;
    let (camera, existing) = camera_files::read(&args.camera)?;
    let poses = robot_poses::read(&args.poses)?;
    if let Some(out) = &args.out {
        sdg_files::check_replaceable(out, Some(&args.camera), existing.as_bytes())?;
    }
    let folder = args.poses.parent().unwrap_or(Path::new("."));
    robot_poses::check_pictures_exist(&poses, folder)?;
    let (mut lines, mut seen, mut views) = (Vec::new(), Vec::new(), Vec::new());
    for (pose, result) in robot_poses::views(&poses, folder, &camera, &board) {
        match result {
            Ok(view) => {
                seen.push(pose);
                views.push(view);
            }
            Err(error) => {
                let error = one_line(&error);
                eprintln!("left out: {error}");
                lines.push(json!({"picture": pose.picture, "error": error}));
            }
        }
    }
    let found = calibrate_hand_eye(&camera.intrinsics, &board, mount, &views)
        .map_err(|error| explained(error.with_picture_names(|k| seen[k].picture.clone()), args))?;
    if let Some(out) = &args.out {
        let camera = found.mounted(camera, mount, args.table_height_mm.map(|height| height / 1000.0));
        let text = camera.update_yaml(&existing).with_context(|| named(out))?;
        sdg_files::extend(out, Some(&args.camera), text.as_bytes())?;
    }
    for (k, pose) in seen.iter().enumerate() {
        let [metres, radians] = found.spread[k];
        lines.push(json!({
            "picture": pose.picture, "corners": views[k].corners.len(), "rms_px": found.pictures_rms_px[k],
            "without_it_mm": 1000.0 * metres, "without_it_deg": radians.to_degrees(),
        }));
    }
    report(args, mount, &found, &seen, lines)?;
    Ok(Outcome::Done)
}

/// Adds the option that corrects the error.
fn explained(error: CalibrationError, args: &HandEyeArgs) -> anyhow::Error {
    match error {
        CalibrationError::OtherBoardScale { scale, .. } => {
            let measured_mm = scale * args.board.measured_mm();
            anyhow!("{error} (--measured-mm; about {measured_mm:.1} by the robot poses)")
        }
        error => error.into(),
    }
}

fn report(args: &HandEyeArgs, mount: Mount, found: &HandEye, seen: &[&RobotPose], lines: Vec<Value>) -> Result<()> {
    let mut stdout = std::io::stdout().lock();
    if args.json {
        let mut object = found.to_json(mount);
        object["pictures"] = json!(lines);
        object["out"] = json!(args.out.as_deref().map(named));
        writeln!(stdout, "{object}")?;
        return Ok(());
    }
    let [frame, _] = HandEye::frame_names(mount);
    let median = upper_median(found.pictures_rms_px.iter().copied()).context("no picture was used")?;
    let [spread_m, spread_rad] = found.max_spread();
    let (spread_mm, spread_deg) = (1000.0 * spread_m, spread_rad.to_degrees());
    let pose = &found.frame_from_camera;
    let [x, y, z]: [f64; 3] = pose.translation.vector.map(|length| without_minus_zero(length * 1000.0, 2)).into();
    let [i, j, k, w]: [f64; 4] = pose.rotation.coords.map(|coordinate| without_minus_zero(coordinate, 5)).into();
    writeln!(
        stdout,
        "{frame}_from_camera: ({x:.2}, {y:.2}, {z:.2}) mm, rotation_xyzw ({i:.5}, {j:.5}, {k:.5}, {w:.5})"
    )?;
    writeln!(
        stdout,
        "  ± {:.2} mm, ± {:.3} degrees; leaving out one picture moves it by up to {spread_mm:.2} mm, {spread_deg:.3} degrees",
        1000.0 * found.sigma_m,
        found.sigma_rad.to_degrees()
    )?;
    writeln!(
        stdout,
        "  reprojection {:.2} px RMS with the robot's poses, {:.2} px without",
        found.rms_px, found.board_rms_px
    )?;
    if let Some([metres, radians]) = found.robot_sigma {
        writeln!(
            stdout,
            "  the robot's poses are off by about {:.2} mm and {:.3} degrees along and about each axis",
            1000.0 * metres,
            radians.to_degrees()
        )?;
    }
    for (pose, rms) in seen.iter().zip(&found.pictures_rms_px) {
        let worse = if *rms > MAX_RMS_RATIO * median {
            ": far more than the others; take it again or leave it out"
        } else {
            ""
        };
        writeln!(stdout, "  {}: {rms:.2} px{worse}", pose.picture)?;
    }
    Ok(())
}
