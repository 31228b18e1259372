//! Errors that end a call of the client or a server.

use std::io;
use std::net::SocketAddr;
use std::time::Duration;

use crate::wire::Status;
use crate::wire::robot_error::RobotErrors;
use crate::wire_error::WireError;

/// Errors that end a call of the client or a server.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the messages explain the fields")]
pub enum FciError {
    /// An operation on a socket failed.
    #[error("{action} {address}: {source}")]
    Socket { action: &'static str, address: String, source: io::Error },
    /// The peer closed the connection.
    #[error("{address} closed the connection")]
    Closed { address: SocketAddr },
    /// The peer did not answer.
    #[error("no {what} from {address} within {} ms", waited.as_millis())]
    Timeout { what: &'static str, address: SocketAddr, waited: Duration },
    /// The peer uses an unsupported version of the protocol.
    #[error("the {peer} speaks version {found} of the protocol, expected {expected}")]
    Version {
        peer: &'static str,
        /// The protocol versions that this client supports, as text.
        expected: String,
        found: u16,
    },
    /// Bytes that are not a valid message.
    #[error("{address}: {source}")]
    Wire { address: SocketAddr, source: WireError },
    /// The robot refused a command.
    #[error("{command}: {status}")]
    Refused { command: &'static str, status: Status },
    /// The robot ended a motion early.
    #[error("the motion was ended: {status}; errors: {errors}; {:.0} % of the last commands arrived in time", 100.0 * success_rate)]
    Motion {
        /// The robot's answer to the Move.
        status: Status,
        /// The errors for which the robot stopped.
        errors: RobotErrors,
        /// Fraction of the last 100 commands that the robot received in time.
        success_rate: f64,
    },
    /// A command that must not be sent.
    #[error("{field}: expected {expected}, found {found}")]
    Command {
        /// The field of the command.
        field: &'static str,
        expected: &'static str,
        found: String,
    },
    /// The simulated robot failed.
    #[error("the simulated robot: {0}")]
    Plant(String),
}

/// Result of this crate's functions.
pub type Result<T> = std::result::Result<T, FciError>;
