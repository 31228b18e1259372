//! The messages, byte for byte: packed, little-endian.
//!
//! Written from the layout in `research_interface` of libfranka-common (Apache-2.0; version 5 is commit b482ee0,
//! version 10 d96c221). TCP carries requests and responses, each after a [`Header`]; UDP carries [`RobotState`] in one
//! direction and [`RobotCommand`] in the other, each in one datagram.

pub(crate) mod codec;
mod commands;
mod hand;
mod header;
mod modes;
mod requests;
mod robot_command;
pub(crate) mod robot_error;
mod state;
mod status;
mod version;

pub use commands::Command;
pub use hand::{HAND_VERSION, HandCommand, HandRequest, HandState, HandStatus};
pub use header::{HAND_HEADER_SIZE, HEADER_SIZE, Header, HeaderKind, MAX_MESSAGE_SIZE};
pub use modes::{ControllerMode, MotionGeneratorMode, RobotMode};
pub use requests::{CollisionBehavior, Deviation, Load, MoveRequest, Request};
pub use robot_command::{COMMAND_SIZE_V5, COMMAND_SIZE_V10, MotionCommand, RobotCommand};
pub use state::{RobotState, STATE_SIZE_V5, STATE_SIZE_V10, Transform};
pub use status::{Response, Status};
pub use version::Version;

/// TCP port of the robot.
pub const ROBOT_PORT: u16 = 1337;
/// TCP port of the hand.
pub const HAND_PORT: u16 = 1338;
