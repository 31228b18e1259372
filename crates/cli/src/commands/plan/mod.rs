//! `sdg plan`: a motion around the obstacles of a workcell, described and drawn; nothing moves.

mod arguments;

use std::path::PathBuf;
use std::time::Instant;

use anyhow::{Context, Result, bail};
use clap::Args;
use sdg_cell::{ExplainedPlan, refused_by_limits, turned_goals};
use sdg_kinematics::collision::Capsule;
use sdg_kinematics::dynamics::ArmDynamics;
use sdg_kinematics::planning::PlanOptions;
use sdg_kinematics::{HAND_OPENING_MAX_M, Trajectory};
use sdg_robot::DEFAULT_SPEED;
use sdg_robot::workcell::Workcell;

use crate::exit::{Outcome, Usage};
use crate::json_line::{json_line, tell};
use crate::robots;
use crate::shared_args::opening_mm;
use arguments::{GoalPose, Held, JointsDeg};

/// `sdg plan`
#[derive(Debug, Args)]
pub struct PlanArgs {
    /// The workcell file, with an [[obstacle]] for every object in the cell
    #[arg(long, value_name = "FILE")]
    pub workcell: PathBuf,
    /// Joint angles at the start: seven, in degrees, as in 0,-45,0,-135,0,90,45; default: the first joints_deg in the
    /// workcell file, else the ready pose
    #[arg(long, value_name = "Q", allow_hyphen_values = true)]
    pub start: Option<JointsDeg>,
    /// Goal of the tcp in the base frame: X,Y,Z in mm; or X,Y,Z,YAW with the hand pointing straight down, rotated by
    /// YAW degrees; or X,Y,Z,ROLL,PITCH,YAW (180,0,YAW points straight down). If given several times, the pose that is
    /// reached fastest is chosen
    #[arg(long, value_name = "POSE", required = true, allow_hyphen_values = true)]
    pub goal: Vec<GoalPose>,
    /// Number of equally spaced angles about the hand's axis at which the goal may be reached: 2 allows exchanged
    /// fingers, 1 only the given pose
    #[arg(long, value_name = "N", default_value_t = 2, value_parser = clap::value_parser!(u32).range(1..=36))]
    pub turns: u32,
    /// The held object, as a capsule along the hand's axis that starts at the tcp: DIAMETER,LENGTH in mm
    #[arg(long, value_name = "SIZE")]
    pub held_mm: Option<Held>,
    /// Distance between the open fingers
    #[arg(long, value_name = "MM", default_value_t = HAND_OPENING_MAX_M * 1e3, value_parser = opening_mm)]
    pub opening_mm: f64,
    /// Minimum distance to all obstacles
    #[arg(long, value_name = "MM", default_value_t = 3.0, value_parser = arguments::margin_mm)]
    pub margin_mm: f64,
    /// Fraction of the joints' velocity limits, above 0 and at most 0.6
    #[arg(long, value_name = "SHARE", default_value_t = DEFAULT_SPEED)]
    pub speed: f64,
    /// Seed of the random search; the same seed gives the same path
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,
    /// Folder for the drawing of the motion
    #[arg(long, value_name = "DIR", default_value = "plan")]
    pub out: PathBuf,
    /// Skip the drawing
    #[arg(long)]
    pub no_drawing: bool,
    /// Print the path as one JSON object on standard output
    #[arg(long)]
    pub json: bool,
}

/// Plans a motion, prints it and draws it.
pub fn run(args: &PlanArgs) -> Result<Outcome> {
    let pace = robots::pace(args.speed)?;
    // An output path that is not a folder is reported before the work; the folder is created when there is a drawing.
    if !args.no_drawing && args.out.exists() {
        sdg_files::prepare_folder(&args.out)?;
    }
    let (workcell, _) = sdg_inputs::read_workcell(&args.workcell)?;
    let mut model = workcell.collision_model(args.opening_mm * 1e-3).map_err(|error| Usage(error.to_string()))?;
    if let Some(Held { diameter_m, length_m }) = args.held_mm {
        let radius_m = 0.5 * diameter_m;
        let far = (length_m - radius_m).max(0.0);
        model.hold(&[Capsule::new([0.0; 3], [0.0, 0.0, far], radius_m)]).map_err(|error| Usage(error.to_string()))?;
    }
    let arm = &workcell.robot.geometry();
    let start = args.start.map_or_else(|| workcell.home().unwrap_or(arm.ready), |JointsDeg(q)| q);
    if args.start.is_some() && arm.limits.are_radians_given_as_degrees(&start) {
        let found = start.map(|angle| angle.to_degrees());
        let found: Vec<String> = found.iter().map(|angle| format!("{angle:.3}")).collect();
        bail!(
            "--start: expected joint angles in degrees, found {}, which fit the joint limits only as radians: radians given as degrees?",
            found.join(",")
        );
    }
    let goals = turned_goals(args.goal.iter().map(|GoalPose(pose)| *pose), args.turns);
    let mut options = PlanOptions::default();
    (options.seed, options.margin_m) = (args.seed, args.margin_mm * 1e-3);

    let started = Instant::now();
    let plan = arm.plan(&model, &start, &goals, None, &options).context("no plan")?;
    let planning_ms = started.elapsed().as_secs_f64() * 1e3;
    let (joints, tcp, dynamics) =
        (pace.free_limits(arm), arm.cartesian_limits, ArmDynamics::new(arm, args.opening_mm * 1e-3));
    let motions = plan.trajectories(&joints, &tcp, &dynamics)?;
    let stopping_secs = plan.stopping_secs(&joints, &tcp, &dynamics)?;
    let explained = ExplainedPlan::new(&model, &plan, &motions, stopping_secs, args.turns, planning_ms);
    tell(args.json, explained.text().trim_end());
    if let Some(refused) = refused_by_limits(&workcell, &motions) {
        tell(args.json, &format!("  sdg grasp would reject it: {refused}"));
    }
    if args.json {
        println!("{}", json_line(&explained.json())?);
    }
    if !args.no_drawing && !motions.is_empty() {
        draw(args, &workcell, &motions)?;
    }
    Ok(Outcome::Done)
}

#[cfg(feature = "simulation")]
fn draw(args: &PlanArgs, workcell: &Workcell, motions: &[Trajectory]) -> Result<()> {
    // The drawing needs a simulator; the plan does not.
    if let Err(missing) = sdg_simulation::load() {
        eprintln!("  no motion is drawn: {missing}");
        return Ok(());
    }
    for file in sdg_evaluation::draw_motions(&args.out, workcell, motions, args.opening_mm * 1e-3)? {
        tell(args.json, &format!("  {}", file.display()));
    }
    Ok(())
}

#[cfg(not(feature = "simulation"))]
fn draw(_args: &PlanArgs, _workcell: &Workcell, _motions: &[Trajectory]) -> Result<()> {
    eprintln!("  this sdg was built without the simulator and draws no motion");
    Ok(())
}
