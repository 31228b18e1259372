//! `sdg grasp`: one grasp, from the picture to the lifted or placed part; with a real or a simulated arm.

use std::path::PathBuf;
use std::time::Instant;

use anyhow::{Context, Result, anyhow};
use clap::Args;
use sdg_camera::{Address, LatestFrame, OpenOptions, PixelFrame};
use sdg_cell::{Ended, GraspSettings, GraspTask, LivePictures, ModelFinder, Pictures};
use sdg_grasp::GraspError;
use sdg_inputs::camera_files;
use sdg_robot::{Arm, CompliantArm, DEFAULT_SPEED, FrankaArm, GraspTarget, PartFinder, Robot, SafetyLimits};

use crate::clock;
use crate::commands::devices;
use crate::exit::{Outcome, Usage};
use crate::interrupt::Interrupt;
use crate::json_line::{json_line, tell};
use crate::live_pictures::{self, RequestArgs};
use crate::robots::{self, Consent, RobotChoice, check_states, confirm, draw_dry_run, print_plan, write_states};
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

/// Reads and checks all inputs, then connects to the arm and grasps.
pub fn run(args: &GraspArgs) -> Result<Outcome> {
    let task = prepare(args)?;
    let choice = RobotChoice::named(args.robot.as_ref(), task.workcell.address.as_deref())?;
    let [width, height] = task.camera.size_px();
    args.request.check_size([width, height], "of the calibration")?;
    let options = OpenOptions { width, height, frame: PixelFrame::Sensor, ..args.request.options(&args.from)? };
    let interrupt = Interrupt::watch();
    // An output path that is not a folder is reported before anything moves; the folder is created when there is
    // something to write.
    if args.out.exists() {
        sdg_files::prepare_folder(&args.out)?;
    }
    match choice {
        RobotChoice::Sim => simulated(args, &task, &interrupt),
        RobotChoice::Network(address) => {
            let camera = LatestFrame::spawn(live_pictures::open(&args.from, &options)?);
            let mut arm = FrankaArm::connect(&address, robots::scheduling(args.no_realtime))?;
            arm.check_model(task.workcell.robot)?;
            let limits = task.workcell.safety_limits();
            let pictures = LivePictures(camera);
            let outcome = attempt(args, &task, &mut arm, limits, pictures, &interrupt, Some(&address.to_string()))?;
            Ok(outcome.unwrap_or(Outcome::Done))
        }
    }
}

fn prepare(args: &GraspArgs) -> Result<GraspTask> {
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
    let camera_path = robots::camera_file(args.camera.as_deref(), camera_of_workcell, &args.workcell)?;
    let (calibrated, _) = camera_files::read(&camera_path)?;
    let camera = camera_files::mounted(&calibrated, &workcell, &camera_path)?;
    let model = sdg_inputs::read_model(&args.grasp_model, &devices::open(&args.compute)?)?;
    if model.facts().lengths.is_none() {
        return Err(GraspError::NoLengths).with_context(|| args.grasp_model.display().to_string());
    }
    check_states(&args.states)?;
    let settings = GraspSettings {
        pace,
        max_detection_age_secs: args.max_detection_age_secs,
        is_soft: args.soft,
        told: args.height.told(workcell.table_height_m),
    };
    let task = GraspTask::new(workcell, model, camera, goal, &settings);
    task.check_room().map_err(|error| Usage(format!("--place: {error}")))?;
    Ok(task)
}

/// Grasps with an arm in MuJoCo.
#[cfg(feature = "simulation")]
fn simulated(args: &GraspArgs, task: &GraspTask, interrupt: &Interrupt) -> Result<Outcome> {
    use sdg_simulation::{RenderConfig, WorkcellConfig};

    robots::check_simulated(&task.workcell, &args.workcell)?;
    let Address::Sim(text) = &args.from else {
        let found = &args.from;
        return Err(
            Usage(format!("--from: with --robot sim expected sim:PART or sim:PART?seed=N, found {found}")).into()
        );
    };
    let scene = robots::simulated_scene(text, &task.workcell.obstacles)?;
    let mut cell = sdg_simulation::Workcell::new(&WorkcellConfig {
        wrist_camera: Some(task.camera.intrinsics),
        camera_pose: Some(task.camera.pose),
        obstacles: task.workcell.obstacles.clone(),
        ..WorkcellConfig::new(scene)
    })?;
    let limits = SafetyLimits {
        fingertip_beyond_tcp_m: sdg_simulation::FINGERTIP_BEYOND_TCP_M,
        ..task.workcell.safety_limits()
    };
    let outcome = attempt(args, task, &mut cell, limits, sdg_evaluation::SimulatedPictures, interrupt, None)?;
    if matches!(outcome, Some(Outcome::Done)) {
        sdg_files::prepare_folder(&args.out)?;
        let path = args.out.join("grasp.png");
        let render = RenderConfig { width: 800, height: 600, ..RenderConfig::default() };
        sdg_files::write_png(&path, &cell.scene_image(render)?)?;
        tell(args.json, &format!("the cell after the grasp: {}", path.display()));
    }
    Ok(outcome.unwrap_or(Outcome::Done))
}

#[cfg(not(feature = "simulation"))]
fn simulated(_args: &GraspArgs, _task: &GraspTask, _interrupt: &Interrupt) -> Result<Outcome> {
    Err(Usage(
        "--robot sim: this sdg was built without the simulator: expected a build with cargo's feature \"simulation\""
            .to_owned(),
    )
    .into())
}

/// One grasp with any arm. A real arm, which has an address, moves only after confirmation by a person or with `--yes`.
/// Returns `None` if the person refused and nothing was moved.
fn attempt<A: CompliantArm, P: Pictures<A>>(
    args: &GraspArgs,
    task: &GraspTask,
    arm: &mut A,
    limits: SafetyLimits,
    pictures: P,
    interrupt: &Interrupt,
    address: Option<&str>,
) -> Result<Option<Outcome>> {
    let mut finder = task.finder(pictures);
    if args.dry_run {
        let target = finder.find_for_plan(arm, task.told())?;
        dry_run(args, task, arm, limits.clone(), target, &finder)?;
    }
    if args.dry_run || address.is_some() {
        let question = match address {
            Some(address) => format!("Move the arm at {address} at {:.0} % of its speed?", args.speed * 100.0),
            None => "Move the simulated arm?".to_owned(),
        };
        if confirm(&question, args.yes)? == Consent::Refused {
            eprintln!("nothing was moved");
            if args.json {
                println!("{}", json_line(&task.refused_record(address.unwrap_or("sim"), clock::elapsed_secs()))?);
            }
            return Ok(None);
        }
    }
    let started = Instant::now();
    let started_secs = arm.state()?.time_secs;
    let mut robot = Robot::new(arm, limits, robots::watch(interrupt));
    let ended = task.run(&mut robot, &mut finder);
    // A failed step is an error, unless the part was not found in a picture.
    let has_failed = match &ended {
        Ok(ended) => ended.failed.is_some() && !ended.found_nothing(),
        Err(_) => true,
    };
    if has_failed || robot.latched().is_some() {
        write_states(&args.states, robot.watch());
    }
    let ended = ended?;
    // Measured by the arm's own clock: a simulated arm moves faster or slower than a real one.
    let secs = robot.state().map_or(started.elapsed().as_secs_f64(), |state| state.time_secs - started_secs);
    print_report(args, task, &ended, secs, address.unwrap_or("sim")).map(Some)
}

/// Plans from the arm's current posture; draws and prints the plan.
fn dry_run<A: Arm, P: Pictures<A>>(
    args: &GraspArgs,
    task: &GraspTask,
    arm: &mut A,
    limits: SafetyLimits,
    target: Option<GraspTarget>,
    finder: &ModelFinder<P>,
) -> Result<()> {
    let plan = task.plan(arm, limits, target, PartFinder::<A>::others(finder))?;
    tell(args.json, "planned, not executed:");
    print_plan(&plan, args.json)?;
    #[cfg(feature = "simulation")]
    if let Err(missing) = sdg_simulation::load() {
        eprintln!("no motion is drawn: {missing}");
        return Ok(());
    }
    for file in draw_dry_run(&plan, &args.out, finder.seen().filter(|_| target.is_some()), &task.workcell)? {
        tell(args.json, &format!("  {}", file.display()));
    }
    Ok(())
}

/// Prints the closing lines, and with `--json` the JSON object.
fn print_report(args: &GraspArgs, task: &GraspTask, ended: &Ended, secs: f64, robot: &str) -> Result<Outcome> {
    if args.json {
        println!("{}", json_line(&task.record(ended, robot, secs, clock::elapsed_secs()))?);
    }
    let Ended { grasp, failed, beside, .. } = ended;
    if let Some(height) = grasp.height.as_ref().and_then(|height| height.settled) {
        let height_mm = 1e3 * (height.height_m - task.workcell.table_height_m);
        let (sigma_mm, source) = (1e3 * height.sigma_m, height.source.name());
        tell(args.json, &format!("its marks are {height_mm:.1} ± {sigma_mm:.1} mm above the table, as {source}"));
    }
    let total_secs = clock::elapsed_secs();
    let took = match robot {
        "sim" => format!("{secs:.1} s of the arm's time, simulated in {total_secs:.1} s"),
        _ => format!("the arm took {secs:.1} s of {total_secs:.1} s since the start"),
    };
    match (failed, &task.place) {
        (None, None) => {
            let width_mm = grasp.closed.map_or(f64::NAN, |hand| hand.opening_m * 1e3);
            // A simulated arm exists only as long as the program.
            let then = if robot == "sim" { "" } else { "; sdg robot open releases it" };
            tell(args.json, &format!("the part is held, {width_mm:.0} mm between the fingers ({took}){then}"));
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
            tell(args.json, &format!("the part {where_it_lies} \"{}\" ({took})", goal.name));
            Ok(Outcome::Done)
        }
        (Some((_, why)), _) if ended.found_nothing() => {
            tell(args.json, why);
            Ok(Outcome::NothingToGrasp)
        }
        (Some((step, why)), _) => Err(anyhow!("{step}: {why}")),
    }
}
