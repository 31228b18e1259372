//! The commands of the robot and their numbers.

use super::version::Version;
use crate::wire_error::WireError;

/// A command; its number depends on the protocol version.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs, reason = "the requests of the same names are documented")]
pub enum Command {
    Connect,
    Move,
    StopMove,
    GetCartesianLimit,
    SetCollisionBehavior,
    SetJointImpedance,
    SetCartesianImpedance,
    SetGuidingMode,
    SetEeToStiffness,
    SetNeToEe,
    SetLoad,
    SetFilters,
    AutomaticErrorRecovery,
    LoadModelLibrary,
    GetRobotModel,
}

const COMMANDS_V5: [Command; 14] = [
    Command::Connect,
    Command::Move,
    Command::StopMove,
    Command::GetCartesianLimit,
    Command::SetCollisionBehavior,
    Command::SetJointImpedance,
    Command::SetCartesianImpedance,
    Command::SetGuidingMode,
    Command::SetEeToStiffness,
    Command::SetNeToEe,
    Command::SetLoad,
    Command::SetFilters,
    Command::AutomaticErrorRecovery,
    Command::LoadModelLibrary,
];

const COMMANDS_V10: [Command; 12] = [
    Command::Connect,
    Command::Move,
    Command::StopMove,
    Command::SetCollisionBehavior,
    Command::SetJointImpedance,
    Command::SetCartesianImpedance,
    Command::SetGuidingMode,
    Command::SetEeToStiffness,
    Command::SetNeToEe,
    Command::SetLoad,
    Command::AutomaticErrorRecovery,
    Command::GetRobotModel,
];

impl Command {
    fn table(version: Version) -> &'static [Command] {
        match version {
            Version::V5 => &COMMANDS_V5,
            Version::V10 => &COMMANDS_V10,
        }
    }

    /// The command with a number.
    ///
    /// # Errors
    /// [`WireError::Value`] for a number without a command.
    pub fn from_number(number: u32, version: Version) -> Result<Self, WireError> {
        let command = usize::try_from(number).ok().and_then(|index| Self::table(version).get(index));
        command.copied().ok_or(WireError::Value { field: "command", found: number })
    }

    /// The number in a version; `None` for a command that the version does not have.
    pub fn number(self, version: Version) -> Option<u32> {
        Self::table(version).iter().position(|&command| command == self).map(|index| index as u32)
    }

    /// The name in messages.
    pub const fn name(self) -> &'static str {
        match self {
            Command::Connect => "connect",
            Command::Move => "move",
            Command::StopMove => "stop",
            Command::GetCartesianLimit => "get Cartesian limit",
            Command::SetCollisionBehavior => "set collision behaviour",
            Command::SetJointImpedance => "set joint impedance",
            Command::SetCartesianImpedance => "set Cartesian impedance",
            Command::SetGuidingMode => "set guiding mode",
            Command::SetEeToStiffness => "set stiffness frame",
            Command::SetNeToEe => "set end effector frame",
            Command::SetLoad => "set load",
            Command::SetFilters => "set filters",
            Command::AutomaticErrorRecovery => "automatic error recovery",
            Command::LoadModelLibrary => "load model library",
            Command::GetRobotModel => "get robot model",
        }
    }
}
