//! `sdg robot home`.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use sdg_kinematics::{Trajectory, ready_pose};
use sdg_robot::{DEFAULT_SPEED, Destination, FREE_CLEARANCE_M, FrankaArm, Robot, Surroundings};

use super::arm_args::ArmArgs;
use crate::exit::{Outcome, Usage};
use crate::interrupt::Interrupt;
use crate::robots::{self, Consent, confirm, write_states};

/// `sdg robot home`
#[derive(Debug, Args)]
pub struct HomeArgs {
    #[command(flatten)]
    arm: ArmArgs,
    /// Home the fingers: move them through their range, once after the hand was switched on; the arm does not move
    #[arg(long)]
    hand: bool,
    /// Do not ask for confirmation; for programs
    #[arg(long)]
    yes: bool,
    /// Fraction of the joints' velocity limits, above 0 and at most 0.6
    #[arg(long, value_name = "SHARE", default_value_t = DEFAULT_SPEED)]
    speed: f64,
    /// Drive an arm on the network from a thread without real-time priority; for simulated arms
    #[arg(long)]
    no_realtime: bool,
    /// File for the arm's last second of states after an error, as CSV
    #[arg(long, value_name = "FILE", default_value = "robot-states.csv")]
    states: PathBuf,
}

pub(super) fn run(args: &HomeArgs) -> Result<Outcome> {
    if args.hand {
        let (mut arm, address) = args.arm.connect()?;
        if confirm(&format!("Move the fingers of the hand at {address}?"), args.yes)? == Consent::Given {
            arm.home_hand()?;
        }
        return Ok(Outcome::Done);
    }
    let Some(path) = &args.arm.workcell else {
        return Err(Usage("expected --workcell FILE, which states where the arm may be".to_owned()).into());
    };
    let pace = robots::pace(args.speed)?;
    let (workcell, _) = sdg_inputs::read_workcell(path)?;
    let address = args.arm.address()?;
    let mut arm = FrankaArm::connect(&address, robots::scheduling(args.no_realtime))?;
    arm.check_model(workcell.robot)?;
    let interrupt = Interrupt::watch();
    let mut robot = Robot::new(&mut arm, workcell.safety_limits(), robots::watch(&interrupt));
    let home = workcell.home().unwrap_or_else(ready_pose);
    let motions = if workcell.obstacles.is_empty() {
        let motion = robot.plan_free(&home, &pace.free_limits(robot.geometry()))?;
        // The motion is checked before the question is asked.
        robot.limits().check(motion.clone()).map_err(sdg_robot::RobotError::from)?;
        vec![motion]
    } else {
        let surroundings = Surroundings {
            obstacles: &workcell.obstacles,
            table_clearance_m: FREE_CLEARANCE_M,
            ..Surroundings::default()
        };
        robot
            .plan_around(&surroundings, &Destination::Configuration(&home), &pace.free_limits(robot.geometry()))?
            .motions
    };
    if motions.iter().all(|motion| motion.duration_secs() <= 0.0) {
        eprintln!("the arm at {address} is at home");
        return Ok(Outcome::Done);
    }
    let secs: f64 = motions.iter().map(Trajectory::duration_secs).sum();
    if confirm(&format!("Move the arm at {address} home, in {secs:.1} s?"), args.yes)? == Consent::Refused {
        return Ok(Outcome::Done);
    }
    eprintln!("moving home, {secs:.1} s; Ctrl-C stops the arm");
    for motion in motions {
        let moved = robot.follow(motion);
        if moved.is_err() {
            write_states(&args.states, robot.watch())?;
        }
        moved?;
    }
    Ok(Outcome::Done)
}
