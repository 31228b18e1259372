//! Errors of a robot, of planning and of perception.

use std::error::Error;

use sdg_kinematics::KinematicsError;
use sdg_kinematics::planning::PlanError;

use crate::arm_state::ArmMode;
use crate::safety::Violation;
use crate::watch::StopReason;

/// Errors of this crate.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the messages explain the fields")]
pub enum RobotError {
    /// A motion violates a limit; it was not started.
    #[error("the motion was not started: {0}")]
    Unsafe(#[from] Violation),
    /// No motion can be planned.
    #[error(transparent)]
    Planning(#[from] KinematicsError),
    /// No path leads around the obstacles of the cell.
    #[error("no path through the cell: {0}")]
    NoWay(#[from] PlanError),
    /// An obstacle of the cell blocks the straight motion up.
    #[error("the motion was not started: {:.0} % of the straight path up can be followed: {why}", .share * 100.0)]
    BlockedAbove { share: f64, why: String },
    /// The arm was stopped on its path.
    #[error("the arm was stopped: {0}")]
    Stopped(StopReason),
    /// The motion was blocked.
    #[error("the arm was blocked: {0}")]
    Blocked(String),
    /// The arm stopped by itself.
    #[error("the arm stopped itself: {0}")]
    Reflex(String),
    /// The arm does not move until it is recovered from an earlier error.
    #[error("nothing moves until a person has checked the arm and recovers it: {0}")]
    Latched(String),
    /// Arm or hand never answered.
    #[error("{peer} could not be reached: {why}")]
    Unreachable {
        /// Arm or hand, with its address.
        peer: String,
        why: String,
    },
    /// Arm or hand no longer answer.
    #[error("the connection to {peer} is lost: {why}")]
    Lost {
        /// Arm or hand, with its address.
        peer: String,
        why: String,
    },
    /// The hand failed.
    #[error("the hand failed: {0}")]
    Hand(String),
    /// Perception itself failed; a picture without the part is not such an error.
    #[error("perception failed: {0}")]
    Perception(String),
    /// A setting outside its range, or one that the arm does not support.
    #[error("{what}: expected {expected}, found {found}")]
    Configuration { what: String, expected: String, found: String },
    /// The system refuses real-time scheduling.
    #[error(
        "real-time scheduling of the control loop: expected a kernel and a user that may use SCHED_FIFO (a line \"@realtime - \
         rtprio 99\" in /etc/security/limits.conf, and the user in that group), found {found}"
    )]
    NoRealTime { found: String },
    /// A lower layer reports another error.
    #[error(transparent)]
    Device(Box<dyn Error + Send + Sync>),
}

impl RobotError {
    /// The error of a motion that is refused before it begins, because nothing moves in this mode.
    pub(crate) fn in_mode(mode: ArmMode) -> Self {
        match mode {
            ArmMode::Reflex => {
                Self::Latched("the arm is in reflex, after a contact or a command that it could not follow".to_owned())
            }
            mode => Self::Stopped(StopReason::Mode(mode)),
        }
    }

    /// Whether the arm was, or may have been, in motion. After such an error nothing moves until a person allows it.
    pub fn latches(&self) -> bool {
        !matches!(
            self,
            Self::Unsafe(_)
                | Self::Planning(_)
                | Self::NoWay(_)
                | Self::BlockedAbove { .. }
                | Self::Latched(_)
                | Self::Unreachable { .. }
                | Self::Perception(_)
                | Self::Configuration { .. }
                | Self::NoRealTime { .. }
        )
    }
}

/// Checks that a setting is above 0 and at most `max`.
///
/// # Errors
/// [`RobotError::Configuration`].
pub(crate) fn check_positive(what: &str, found: f64, max: f64) -> Result<()> {
    check(found > 0.0 && found <= max, what, format!("above 0 and at most {max}"), found)
}

/// Checks that a setting is from 0 to `max`.
///
/// # Errors
/// [`RobotError::Configuration`].
pub(crate) fn check_not_negative(what: &str, found: f64, max: f64) -> Result<()> {
    check((0.0..=max).contains(&found), what, format!("0 to {max}"), found)
}

fn check(is_valid: bool, what: &str, expected: String, found: f64) -> Result<()> {
    match is_valid {
        true => Ok(()),
        false => Err(RobotError::Configuration { what: what.to_owned(), expected, found: found.to_string() }),
    }
}

/// Result of this crate's functions.
pub type Result<T> = std::result::Result<T, RobotError>;
