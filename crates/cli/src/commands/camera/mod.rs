//! `sdg camera`: calibration and live pictures. Each verb's arguments stand beside what it does.

mod board;
mod board_in_use;
mod calibrate;
mod grab;
mod hand_eye;
mod list;
mod table;
mod watch;

use anyhow::Result;
use clap::Subcommand;

use crate::exit::Outcome;

/// The verbs of `sdg camera`.
#[derive(Debug, Subcommand)]
pub enum CameraCommand {
    /// The cameras of this machine
    List(list::ListArgs),
    /// Single frames to files
    Grab(grab::GrabArgs),
    /// A camera's frames, watched for faults
    Watch(watch::WatchArgs),
    /// A board to print, for calibrate, table and hand-eye
    Board(board::BoardArgs),
    /// Pictures of the board to a camera file
    Calibrate(calibrate::CalibrateArgs),
    /// One picture of the board on the table: where the camera is
    Table(table::TableArgs),
    /// Robot poses and pictures of the board: where the camera is on the robot, or beside it
    HandEye(hand_eye::HandEyeArgs),
}

/// Runs one of them.
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
