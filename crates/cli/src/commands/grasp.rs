//! `sdg grasp`: one grasp, from the picture to the lifted or placed part; with a real or a simulated arm.

use std::path::PathBuf;
use std::time::Instant;

use anyhow::{Context, Result, anyhow};
use clap::Args;
use sdg_camera::{Address, LatestFrame, PixelFrame};
use sdg_cell::{
    DryRun, Ended, LivePictures, ModelFinder, MountedCamera, Pictures, SeenOutline, UNKNOWN_HEIGHTS_M,
    height_measurement, part_shape, run_sequence,
};
use sdg_grasp::{GraspError, GraspModel};
use sdg_inputs::camera_files;
use sdg_robot::height::HeightReport;
use sdg_robot::workcell::Workcell;
use sdg_robot::{
    Arm, CompliantArm, DEFAULT_SPEED, FrankaArm, GraspConfig, GraspOutcome, GraspReport, GraspStep, GraspTarget,
    PlaceGoal, PlacingConfig, Robot, SafetyLimits, TouchDown,
};
use serde_json::{Value, json};

use crate::clock;
use crate::commands::devices;
use crate::exit::{Outcome, Usage};
use crate::interrupt::Interrupt;
use crate::json_line::json_line;
use crate::live_pictures::{self, RequestArgs};
use crate::robots::{self, Consent, RobotChoice, confirm, draw_dry_run, print_plan, write_states};
use crate::shared_args::{ComputeArgs, ToldHeightArgs};

/// `sdg grasp`
#[derive(Debug, Args)]
pub struct GraspArgs {
    /// The arm: HOST or HOST:PORT of a Franka, or sim for a simulated one; default: the address in the workcell file
    #[arg(long, value_name = "ADDRESS|sim")]
    pub robot: Option<RobotChoice>,
    /// The camera, as for sdg detect --from. With --robot sim: sim:PART or sim:PART?seed=N, a part on the simulated
    /// arm's table
    #[arg(long, value_name = "ADDRESS")]
    pub from: Address,
    /// The camera file; default: the one named in the workcell file
    #[arg(long, value_name = "FILE")]
    pub camera: Option<PathBuf>,
    /// A grasp model that sdg teach made from photos of a calibrated camera
    #[arg(long, value_name = "FILE")]
    pub grasp_model: PathBuf,
    /// The workcell file: robot, tool, camera, table, the arm's workspace and look-out poses
    #[arg(long, value_name = "FILE")]
    pub workcell: PathBuf,
    /// Put the part down at this place of the workcell file, and check its position with the camera: NAME, or NAME:CELL
    /// for a cell of a tray, counted from 1 along the tray's x axis
    #[arg(long, value_name = "NAME")]
    pub place: Option<String>,
    /// The part's height
    #[command(flatten)]
    pub height: ToldHeightArgs,
    /// Descend softly over the last 2 cm, and stop at contact: for a table whose height is not known to a millimetre
    #[arg(long)]
    pub soft: bool,
    /// Plan the grasp from the arm's current posture, draw it, and ask for confirmation before anything moves
    #[arg(long)]
    pub dry_run: bool,
    /// Do not ask for confirmation; for programs
    #[arg(long)]
    pub yes: bool,
    /// Fraction of the joints' velocity limits, above 0 and at most 0.6
    #[arg(long, value_name = "SHARE", default_value_t = DEFAULT_SPEED)]
    pub speed: f64,
    /// Maximum age of a picture on which a motion is based
    #[arg(long, value_name = "SECS", default_value_t = 1.0)]
    pub max_detection_age_secs: f64,
    /// Drive an arm on the network from a thread without real-time priority; for simulated arms
    #[arg(long)]
    pub no_realtime: bool,
    /// Folder for the drawings of --dry-run, and for grasp.png, the cell after a simulated grasp
    #[arg(long, value_name = "DIR", default_value = "dry-run")]
    pub out: PathBuf,
    /// File for the arm's last second of states after an error, as CSV
    #[arg(long, value_name = "FILE", default_value = "robot-states.csv")]
    pub states: PathBuf,
    /// Device for the network
    #[command(flatten)]
    pub compute: ComputeArgs,
    /// End with one JSON object on standard output
    #[arg(long)]
    pub json: bool,
    /// Settings of the camera; its size is that of the camera file
    #[command(flatten)]
    pub request: RequestArgs,
}

/// The inputs of a grasp besides the arm.
struct Prepared {
    workcell: Workcell,
    model: GraspModel,
    camera: MountedCamera,
    config: GraspConfig,
    place: Option<(PlaceGoal, PlacingConfig)>,
}

/// Reads and checks all inputs, then connects to the arm and grasps.
pub fn run(args: &GraspArgs) -> Result<Outcome> {
    let prepared = prepare(args)?;
    let choice = RobotChoice::named(args.robot.as_ref(), prepared.workcell.address.as_deref())?;
    let interrupt = Interrupt::watch();
    // An output path that is not a folder is reported before anything moves; the folder is created when there is
    // something to write.
    if args.out.exists() {
        sdg_files::prepare_folder(&args.out)?;
    }
    match choice {
        RobotChoice::Sim => simulated(args, &prepared, &interrupt),
        RobotChoice::Network(address) => {
            let mut options = args.request.options();
            [options.width, options.height] = prepared.camera.size_px();
            options.frame = PixelFrame::Sensor;
            let camera = LatestFrame::spawn(live_pictures::open(&args.from, &options)?);
            let mut arm = FrankaArm::connect(&address, robots::scheduling(args.no_realtime))?;
            arm.check_model(prepared.workcell.robot)?;
            let limits = prepared.workcell.safety_limits();
            attempt(args, &prepared, &mut arm, limits, LivePictures(camera), &interrupt, Some(&address.to_string()))
        }
    }
}

fn prepare(args: &GraspArgs) -> Result<Prepared> {
    let (workcell, camera_of_workcell) = sdg_inputs::read_workcell(&args.workcell)?;
    let goal = match &args.place {
        None => None,
        Some(text) => Some(workcell.place(text).map_err(|error| Usage(format!("--{error}")))?),
    };
    let pace = robots::pace(args.speed)?;
    if !(args.max_detection_age_secs > 0.0 && args.max_detection_age_secs.is_finite()) {
        let found = args.max_detection_age_secs;
        return Err(Usage(format!("--max-detection-age-secs: expected a positive number, found {found}")).into());
    }
    let camera_path = args.camera.clone().or(camera_of_workcell).ok_or_else(|| {
        Usage(format!("expected --camera FILE, or a file under [camera] in {}", args.workcell.display()))
    })?;
    let (calibrated, _) = camera_files::read(&camera_path)?;
    let camera = camera_files::mounted(&calibrated, &workcell, &camera_path)?;
    let model = sdg_inputs::read_model(&args.grasp_model, &devices::open(&args.compute)?)?;
    if model.facts().lengths.is_none() {
        return Err(GraspError::NoLengths).with_context(|| args.grasp_model.display().to_string());
    }
    sdg_files::check_writable(&args.states)?;
    let told = args.height.told(workcell.table_height_m);
    let camera = camera.with_marks_at(&model, told.as_ref());
    let config = GraspConfig {
        height: height_measurement(&model, &camera, told),
        pace,
        max_detection_age_secs: args.max_detection_age_secs,
        soft_approach: args.soft.then(TouchDown::default),
        part: part_shape(&model),
        ..workcell.grasp_config()
    };
    let symmetry = model.facts().symmetry;
    let place = goal.map(|goal| (goal, PlacingConfig { symmetry, ..PlacingConfig::default() }));
    if let (Some((goal, placing)), Some(part)) = (&place, &config.part) {
        let room = goal.check_room(part, symmetry, placing.release_margin_m);
        room.map_err(|error| Usage(format!("--place: {error}")))?;
    }
    Ok(Prepared { workcell, model, camera, config, place })
}

/// Grasps with an arm in MuJoCo.
#[cfg(feature = "simulation")]
fn simulated(args: &GraspArgs, prepared: &Prepared, interrupt: &Interrupt) -> Result<Outcome> {
    use sdg_simulation::{RenderConfig, WorkcellConfig};

    let Address::Sim(text) = &args.from else {
        let found = &args.from;
        return Err(
            Usage(format!("--from: with --robot sim expected sim:PART or sim:PART?seed=N, found {found}")).into()
        );
    };
    let scene = robots::simulated_scene(text)?;
    let mut cell = sdg_simulation::Workcell::new(&WorkcellConfig {
        wrist_camera: Some(prepared.camera.intrinsics),
        camera_pose: Some(prepared.camera.pose),
        obstacles: prepared.workcell.obstacles.clone(),
        ..WorkcellConfig::new(scene)
    })?;
    let limits = SafetyLimits {
        fingertip_beyond_tcp_m: sdg_simulation::FINGERTIP_BEYOND_TCP_M,
        ..prepared.workcell.safety_limits()
    };
    let outcome = attempt(args, prepared, &mut cell, limits, sdg_evaluation::SimulatedPictures, interrupt, None)?;
    if matches!(outcome, Outcome::Done) && !args.dry_run {
        sdg_files::prepare_folder(&args.out)?;
        let path = args.out.join("grasp.png");
        let render = RenderConfig { width: 800, height: 600, ..RenderConfig::default() };
        sdg_files::write_png(&path, &cell.scene_image(render)?)?;
        eprintln!("the cell after the grasp: {}", path.display());
    }
    Ok(outcome)
}

#[cfg(not(feature = "simulation"))]
fn simulated(_args: &GraspArgs, _prepared: &Prepared, _interrupt: &Interrupt) -> Result<Outcome> {
    Err(Usage(
        "--robot sim: this sdg was built without the simulator: expected a build with cargo's feature \"simulation\""
            .to_owned(),
    )
    .into())
}

/// One grasp with any arm. A real arm, which has an address, moves only after confirmation by a person or with `--yes`.
fn attempt<A: CompliantArm, P: Pictures<A>>(
    args: &GraspArgs,
    prepared: &Prepared,
    arm: &mut A,
    limits: SafetyLimits,
    pictures: P,
    interrupt: &Interrupt,
    address: Option<&str>,
) -> Result<Outcome> {
    let mut finder = ModelFinder::new(prepared.model.clone(), prepared.camera, pictures);
    if prepared.config.height.is_some() {
        finder = finder.with_heights(UNKNOWN_HEIGHTS_M);
    }
    if prepared.place.is_some() {
        finder.places.clone_from(&prepared.workcell.places);
    }
    if args.dry_run {
        let target = finder.find_for_plan(arm)?;
        dry_run(args, prepared, arm, limits.clone(), target, finder.seen())?;
    }
    if args.dry_run || address.is_some() {
        let question = match address {
            Some(address) => format!("Move the arm at {address} at {:.0} % of its speed?", args.speed * 100.0),
            None => "Move the simulated arm?".to_owned(),
        };
        if confirm(&question, args.yes)? == Consent::Refused {
            eprintln!("nothing was moved");
            return Ok(Outcome::Done);
        }
    }
    let started = Instant::now();
    let started_secs = arm.state()?.time_secs;
    let camera_pose = prepared.camera.pose;
    let mut robot = Robot::new(arm, limits, robots::watch(interrupt));
    let ended = run_sequence(&mut robot, &mut finder, camera_pose, &prepared.config, prepared.place.as_ref());
    // A failed step is an error, unless the part was not found in a picture.
    let has_failed = match &ended {
        Ok(ended) => ended.failed.is_some() && !is_nothing_found(&ended.grasp),
        Err(_) => true,
    };
    if has_failed || robot.latched().is_some() {
        write_states(&args.states, robot.watch())?;
    }
    let ended = ended?;
    // By the arm's own clock: a simulated arm moves faster or slower than a real one.
    let secs = robot.state().map_or(started.elapsed().as_secs_f64(), |state| state.time_secs - started_secs);
    print_report(args, prepared, &ended, secs, address.unwrap_or("sim"))
}

/// Plans from the arm's current posture; draws and prints the plan.
fn dry_run<A: Arm>(
    args: &GraspArgs,
    prepared: &Prepared,
    arm: &mut A,
    limits: SafetyLimits,
    target: Option<GraspTarget>,
    seen: Option<&SeenOutline>,
) -> Result<()> {
    let (state, hand) = (arm.state()?, arm.hand()?);
    let camera_pose = prepared.camera.pose;
    let place = prepared.place.as_ref();
    let plan = DryRun::plan(state, hand.opening_m, target, limits, camera_pose, &prepared.config, place)?;
    eprintln!("planned, not executed:");
    print_plan(&plan, target.is_some())?;
    #[cfg(feature = "simulation")]
    if let Err(missing) = sdg_simulation::load() {
        eprintln!("no motion is drawn: {missing}");
        return Ok(());
    }
    for file in draw_dry_run(&plan, &args.out, seen.filter(|_| target.is_some()), &prepared.workcell.obstacles)? {
        eprintln!("  {}", file.display());
    }
    Ok(())
}

/// Prints the closing lines, and with `--json` the JSON object.
fn print_report(args: &GraspArgs, prepared: &Prepared, ended: &Ended, secs: f64, robot: &str) -> Result<Outcome> {
    if args.json {
        println!("{}", json_line(&to_json(prepared, ended, secs, robot))?);
    }
    let Ended { grasp, failed, beside, .. } = ended;
    if let Some(height) = grasp.height.as_ref().and_then(|height| height.settled) {
        let height_mm = 1e3 * (height.height_m - prepared.workcell.table_height_m);
        let (sigma_mm, source) = (1e3 * height.sigma_m, height.source.name());
        eprintln!("its marks are {height_mm:.1} ± {sigma_mm:.1} mm above the table, as {source}");
    }
    let total_secs = clock::elapsed_secs();
    let took = match robot {
        "sim" => format!("{secs:.1} s of the arm's time, simulated in {total_secs:.1} s"),
        _ => format!("the arm took {secs:.1} s of {total_secs:.1} s since the start"),
    };
    match (failed, &prepared.place) {
        (None, None) => {
            let width_mm = grasp.closed.map_or(f64::NAN, |hand| hand.opening_m * 1e3);
            // A simulated arm exists only as long as the program.
            let then = if robot == "sim" { "" } else { "; sdg robot open releases it" };
            eprintln!("the part is held, {width_mm:.0} mm between the fingers ({took}){then}");
            Ok(Outcome::Done)
        }
        (None, Some((goal, _))) => {
            let where_it_lies = match (beside, goal.bin_m) {
                (Some(_), Some(_)) => "is in".to_owned(),
                (None, _) => "was released above".to_owned(),
                (Some(error), None) => format!(
                    "lies {:.1} mm and {:.1}° beside its place in",
                    error.distance_m() * 1e3,
                    error.angle_rad.abs().to_degrees()
                ),
            };
            eprintln!("the part {where_it_lies} \"{}\" ({took})", goal.name);
            Ok(Outcome::Done)
        }
        (Some((_, why)), _) if is_nothing_found(grasp) => {
            eprintln!("{why}");
            Ok(Outcome::NothingToGrasp)
        }
        (Some((step, why)), _) => Err(anyhow!("{step}: {why}")),
    }
}

/// Whether a picture was taken and did not contain the part. If the first motion was rejected, no picture was taken.
fn is_nothing_found(report: &GraspReport) -> bool {
    let is_look = matches!(report.outcome, GraspOutcome::Failed { step: GraspStep::Detect, .. });
    is_look && report.targets.last() == Some(&None)
}

fn to_json(prepared: &Prepared, ended: &Ended, secs: f64, robot: &str) -> Value {
    let Ended { grasp: report, failed, beside, touched } = ended;
    let target = report.targets.iter().rev().flatten().next().map(|target| {
        let p = target.base_from_tcp.translation.vector;
        let along = target.base_from_tcp.rotation * nalgebra::Vector3::x();
        json!({
            "frame": "base",
            "p_m": [p.x, p.y, p.z],
            "yaw_deg": along.y.atan2(along.x).to_degrees(),
            "opening_m": target.jaw_width_m,
            "score": target.score,
        })
    });
    let last_step = if prepared.place.is_some() { GraspStep::Check } else { GraspStep::Hold };
    let (step, why) = match failed {
        None => (last_step, None),
        Some((step, why)) => (*step, Some(why)),
    };
    let mut object = json!({
        "robot": robot,
        "model": prepared.model.kind().letter(),
        "object": prepared.model.object(),
        "held": report.outcome.is_held(),
        "step": step.name(),
        "why": why,
        "looks": report.looks,
        "target": target,
        "closed_width_m": report.closed.map(|hand| hand.opening_m),
        "seconds": secs,
        "total_seconds": clock::elapsed_secs(),
    });
    if let Some(height) = &report.height {
        object["height"] = height_json(height, prepared.workcell.table_height_m);
    }
    if let Some((goal, _)) = &prepared.place {
        object["place"] = json!({
            "name": goal.name,
            "placed": failed.is_none(),
            "beside_mm": beside.map(|error| error.distance_m() * 1e3),
            "turned_deg": beside.map(|error| error.angle_rad.abs().to_degrees()),
            "pressed_n": touched.iter().map(|touched| touched.force_n).collect::<Vec<_>>(),
        });
    }
    object
}

/// The height of the marks above the table, and its source.
fn height_json(height: &HeightReport, table_height_m: f64) -> Value {
    let over_table_mm = |height_m: f64| 1e3 * (height_m - table_height_m);
    json!({
        "source": height.settled.map(|settled| settled.source.name()),
        "mark_height_mm": height.settled.map(|settled| over_table_mm(settled.height_m)),
        "sigma_mm": height.settled.map(|settled| 1e3 * settled.sigma_m),
        "measured_mm": height.measured.map(|measured| over_table_mm(measured.height_m)),
        "measured_sigma_mm": height.measured.map(|measured| 1e3 * measured.sigma_m),
        "not_measured": height.why_not,
    })
}
