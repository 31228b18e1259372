//! `sdg robot`: manual control of a real arm. The arguments of most commands are in the commands' files.

mod arm_args;
mod hand;
mod home;
mod state;

use anyhow::Result;
use clap::{Args, Subcommand};
use sdg_robot::Arm;

use arm_args::ArmArgs;

use crate::exit::Outcome;
use crate::robots::{Consent, confirm};

/// The commands of `sdg robot`.
#[derive(Debug, Subcommand)]
pub enum RobotCommand {
    /// Print the state of arm and hand, and whether they can move
    State(state::StateArgs),
    /// Move the arm to its first look-out pose that is given as joint angles, else to Franka's ready pose; with --hand,
    /// home the fingers instead
    Home(home::HomeArgs),
    /// Clear the error after a reflex, once a person has checked the cell. Nothing moves
    Recover(RecoverArgs),
    /// Open the hand
    Open(hand::OpenArgs),
    /// Close the hand on the object between its fingers
    Close(hand::CloseArgs),
}

/// `sdg robot recover`
#[derive(Debug, Args)]
pub struct RecoverArgs {
    #[command(flatten)]
    arm: ArmArgs,
    /// Confirm that a person has checked the cell; do not ask
    #[arg(long)]
    yes: bool,
}

/// Runs one of the commands.
pub fn run(command: &RobotCommand) -> Result<Outcome> {
    match command {
        RobotCommand::State(args) => state::run(args),
        RobotCommand::Home(args) => home::run(args),
        RobotCommand::Recover(args) => recover(args),
        RobotCommand::Open(args) => hand::open(args),
        RobotCommand::Close(args) => hand::close(args),
    }
}

fn recover(args: &RecoverArgs) -> Result<Outcome> {
    let (mut arm, address) = args.arm.connect()?;
    let question = format!("Is the space around the arm at {address} clear, and may it accept motions again?");
    if confirm(&question, args.yes)? == Consent::Refused {
        return Ok(Outcome::Done);
    }
    arm.recover()?;
    println!("the arm is in mode \"{}\"", arm.state()?.mode.name());
    Ok(Outcome::Done)
}
