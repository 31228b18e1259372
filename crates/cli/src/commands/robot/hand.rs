//! `sdg robot open` and `close`.

use std::path::{Path, PathBuf};

use anyhow::Result;
use clap::Args;
use sdg_kinematics::HAND_OPENING_MAX_M;
use sdg_robot::{Arm, FrankaArm, HandCommand, HandState, Load, Watch};

use super::arm_args::ArmArgs;
use crate::exit::{Outcome, Usage};
use crate::interrupt::Interrupt;
use crate::robots::{self, check_states, write_states};
use crate::shared_args::opening_mm;

/// Speed of the fingers relative to each other, in m/s.
const SPEED_M_S: f64 = 0.05;
/// Target width for closing on an object of unknown width.
const ANY_WIDTH_M: f64 = 0.5 * HAND_OPENING_MAX_M;
/// Tolerances below and above that width. Any final width up to the largest opening counts as grasped, except for that
/// of an empty hand.
const ANY_TOLERANCE_M: [f64; 2] = [ANY_WIDTH_M; 2];
/// Maximum continuous grasping force of the hand, in N.
const MAX_FORCE_N: f64 = 70.0;

/// `sdg robot open`
#[derive(Debug, Args)]
pub struct OpenArgs {
    #[command(flatten)]
    arm: ArmArgs,
    /// Distance between the fingers, 0 to 80
    #[arg(long, value_name = "MM", default_value_t = 80.0, value_parser = opening_mm)]
    width_mm: f64,
    /// File for the arm's last second of states after an error, as CSV
    #[arg(long, value_name = "FILE", default_value = "robot-states.csv")]
    states: PathBuf,
}

/// `sdg robot close`
#[derive(Debug, Args)]
pub struct CloseArgs {
    #[command(flatten)]
    arm: ArmArgs,
    /// Force of each finger, 1 to 70
    #[arg(long, value_name = "N", default_value_t = 20.0)]
    force_n: f64,
    /// File for the arm's last second of states after an error, as CSV
    #[arg(long, value_name = "FILE", default_value = "robot-states.csv")]
    states: PathBuf,
}

pub(super) fn open(args: &OpenArgs) -> Result<Outcome> {
    check_states(&args.states)?;
    let (mut arm, _) = args.arm.connect()?;
    let to = HandCommand::Move { opening_m: args.width_mm * 1e-3, speed_m_s: SPEED_M_S };
    let hand = command(&mut arm, to, &args.states)?;
    // The hand no longer holds an object.
    arm.set_load(Load::NONE)?;
    println!("the hand is {:.1} mm open", hand.opening_m * 1e3);
    Ok(Outcome::Done)
}

pub(super) fn close(args: &CloseArgs) -> Result<Outcome> {
    if !(1.0..=MAX_FORCE_N).contains(&args.force_n) {
        return Err(Usage(format!("--force-n: expected 1 to {MAX_FORCE_N}, found {}", args.force_n)).into());
    }
    check_states(&args.states)?;
    let (mut arm, _) = args.arm.connect()?;
    let close = HandCommand::Grasp {
        width_m: ANY_WIDTH_M,
        tolerance_m: ANY_TOLERANCE_M,
        speed_m_s: SPEED_M_S,
        force_n: args.force_n,
    };
    let hand = command(&mut arm, close, &args.states)?;
    let holds = if hand.is_grasping { "and holds something" } else { "and holds nothing" };
    println!("the hand is closed to {:.1} mm {holds}", hand.opening_m * 1e3);
    Ok(Outcome::Done)
}

fn command(arm: &mut FrankaArm, command: HandCommand, states: &Path) -> Result<HandState> {
    move_fingers(states, |watch| {
        arm.start_hand(command)?;
        arm.finish_hand(watch)
    })
}

/// Moves the fingers; Ctrl-C stops them. Writes the arm's last second of states after an error.
pub(super) fn move_fingers<T>(states: &Path, motion: impl FnOnce(&mut Watch) -> sdg_robot::Result<T>) -> Result<T> {
    let mut watch = robots::watch(&Interrupt::watch());
    let moved = motion(&mut watch);
    if moved.is_err() {
        write_states(states, &watch);
    }
    Ok(moved?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use sdg_robot::held_widths_m;

    #[test]
    fn closing_holds_thin_and_wide_objects() {
        let widths_m = held_widths_m(ANY_WIDTH_M, ANY_TOLERANCE_M);
        assert_eq!([0.0005, 0.002, 0.078].map(|width_m| widths_m.contains(&width_m)), [false, true, true]);
    }
}
