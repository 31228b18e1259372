//! The robot's answers. Their numbers depend on command and version.

use std::fmt;

use super::commands::Command;
use super::version::Version;
use crate::wire_error::WireError;

/// The result of a command.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Status {
    /// Done.
    Success,
    /// The motion is running; a second answer follows at its end.
    MotionStarted,
    /// Another command ended the motion.
    Preempted,
    /// A safety function ended the motion (version 10).
    PreemptedBySafety,
    /// A safety function is active (version 10).
    RejectedBySafety,
    /// The command is not possible in the robot's present mode.
    NotPossible,
    /// A Cartesian motion would start at a singular pose.
    StartAtSingularPose,
    /// An argument is out of range.
    InvalidArgument,
    /// An error stopped the motion.
    ReflexAborted,
    /// A person stopped the robot.
    EmergencyAborted,
    /// The commands were invalid.
    InputErrorAborted,
    /// The motion was stopped for another reason.
    Aborted,
    /// Only a person at the robot can recover.
    ManualRecoveryRequired,
    /// The robot does not support the client's version.
    IncompatibleVersion,
    /// The command failed.
    Error,
}

impl fmt::Display for Status {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Status::Success => "success",
            Status::MotionStarted => "motion started",
            Status::Preempted => "preempted by a stop",
            Status::PreemptedBySafety => "preempted by a safety function",
            Status::RejectedBySafety => "rejected, a safety function is active",
            Status::NotPossible => "not possible in the robot's present mode",
            Status::StartAtSingularPose => "rejected, the start is a singular pose",
            Status::InvalidArgument => "rejected, an argument is out of range",
            Status::ReflexAborted => "stopped by a reflex",
            Status::EmergencyAborted => "stopped by the user stop",
            Status::InputErrorAborted => "stopped by invalid commands",
            Status::Aborted => "aborted",
            Status::ManualRecoveryRequired => "rejected, the recovery needs a person at the robot",
            Status::IncompatibleVersion => "another version of the protocol",
            Status::Error => "failed",
        })
    }
}

const CONNECT: &[Status] = &[Status::Success, Status::IncompatibleVersion];
const MOVE_V5: &[Status] = &[
    Status::Success,
    Status::MotionStarted,
    Status::Preempted,
    Status::NotPossible,
    Status::StartAtSingularPose,
    Status::InvalidArgument,
    Status::ReflexAborted,
    Status::EmergencyAborted,
    Status::InputErrorAborted,
    Status::Aborted,
];
const MOVE_V10: &[Status] = &[
    Status::Success,
    Status::MotionStarted,
    Status::Preempted,
    Status::PreemptedBySafety,
    Status::RejectedBySafety,
    Status::NotPossible,
    Status::StartAtSingularPose,
    Status::InvalidArgument,
    Status::ReflexAborted,
    Status::EmergencyAborted,
    Status::InputErrorAborted,
    Status::Aborted,
];
const STOP_V5: &[Status] =
    &[Status::Success, Status::NotPossible, Status::EmergencyAborted, Status::ReflexAborted, Status::Aborted];
const STOP_V10: &[Status] = &[
    Status::Success,
    Status::NotPossible,
    Status::RejectedBySafety,
    Status::EmergencyAborted,
    Status::ReflexAborted,
    Status::Aborted,
];
const SETTER: &[Status] = &[Status::Success, Status::NotPossible, Status::InvalidArgument, Status::RejectedBySafety];
const RECOVERY_V5: &[Status] = &[
    Status::Success,
    Status::NotPossible,
    Status::ManualRecoveryRequired,
    Status::ReflexAborted,
    Status::EmergencyAborted,
    Status::Aborted,
];
const RECOVERY_V10: &[Status] = &[
    Status::Success,
    Status::NotPossible,
    Status::RejectedBySafety,
    Status::ManualRecoveryRequired,
    Status::ReflexAborted,
    Status::EmergencyAborted,
    Status::Aborted,
];
const GETTER: &[Status] = &[Status::Success, Status::NotPossible, Status::RejectedBySafety];
const LIBRARY: &[Status] = &[Status::Success, Status::Error];

impl Status {
    /// The statuses of a command, ordered by their numbers from 0 on.
    fn table(command: Command, version: Version) -> &'static [Status] {
        match (command, version) {
            (Command::Connect, _) => CONNECT,
            (Command::Move, Version::V5) => MOVE_V5,
            (Command::Move, Version::V10) => MOVE_V10,
            (Command::StopMove, Version::V5) => STOP_V5,
            (Command::StopMove, Version::V10) => STOP_V10,
            (Command::AutomaticErrorRecovery, Version::V5) => RECOVERY_V5,
            (Command::AutomaticErrorRecovery, Version::V10) => RECOVERY_V10,
            (Command::LoadModelLibrary, _) => LIBRARY,
            (Command::GetRobotModel, _) => GETTER,
            // Version 5 has only the first three.
            _ => SETTER,
        }
    }

    /// The status with a number.
    ///
    /// # Errors
    /// [`WireError::Value`] for a number without a status.
    pub fn from_number(number: u8, command: Command, version: Version) -> Result<Self, WireError> {
        Self::table(command, version)
            .get(usize::from(number))
            .copied()
            .ok_or(WireError::Value { field: "status", found: number.into() })
    }

    /// The number of the status; `None` if the command does not have it.
    pub fn number(self, command: Command, version: Version) -> Option<u8> {
        Self::table(command, version).iter().position(|&status| status == self).map(|index| index as u8)
    }
}

/// A response: its status, and further data for some commands.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Response {
    /// The result of the command.
    pub status: Status,
    /// Bytes after the status, such as the server's version or the robot's description.
    pub rest: Vec<u8>,
}

impl Response {
    /// Reads the payload of a response.
    ///
    /// # Errors
    /// [`WireError`] for an empty payload or an unknown status.
    pub fn decode(payload: &[u8], command: Command, version: Version) -> Result<Self, WireError> {
        let Some((&status, rest)) = payload.split_first() else {
            return Err(WireError::Short { message: "response", expected: 1, found: 0 });
        };
        Ok(Self { status: Status::from_number(status, command, version)?, rest: rest.to_vec() })
    }
}
