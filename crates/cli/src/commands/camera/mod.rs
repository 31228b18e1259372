//! `sdg camera`: calibration and live pictures. Each command's arguments are in the command's file.

mod board;
mod board_in_use;
mod calibrate;
mod grab;
mod hand_eye;
mod list;
mod table;
mod taking;
mod watch;

use anyhow::Result;
use clap::Subcommand;

use crate::exit::Outcome;

/// The commands of `sdg camera`.
#[derive(Debug, Subcommand)]
pub enum CameraCommand {
    /// List the cameras of this machine
    List(list::ListArgs),
    /// Save single frames to files
    Grab(grab::GrabArgs),
    /// Watch a camera and report its faults
    Watch(watch::WatchArgs),
    /// Write a board to print, for calibrate, table and hand-eye
    Board(board::BoardArgs),
    /// Calibrate a camera from given pictures of the board, or from pictures that it takes by itself, and write a
    /// camera file
    #[command(
        override_usage = "sdg camera calibrate [OPTIONS] <PICTURE>...\n       sdg camera calibrate [OPTIONS] --from <ADDRESS>"
    )]
    Calibrate(calibrate::CalibrateArgs),
    /// Find a camera's pose from one picture of the board on the table
    Table(table::TableArgs),
    /// Find the pose of a camera on the robot's hand or beside the robot, from robot poses and pictures of the board
    HandEye(hand_eye::HandEyeArgs),
}

/// Runs one of the commands.
pub fn run(command: &CameraCommand) -> Result<Outcome> {
    match command {
        CameraCommand::List(args) => list::run(args),
        CameraCommand::Grab(args) => grab::run(args),
        CameraCommand::Watch(args) => watch::run(args),
        CameraCommand::Board(args) => board::run(args),
        CameraCommand::Calibrate(args) => calibrate::run(args),
        CameraCommand::Table(args) => table::run(args),
        CameraCommand::HandEye(args) => hand_eye::run(args),
    }
}
