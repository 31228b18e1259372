//! What can go wrong.

use std::io;
use std::net::SocketAddr;
use std::time::Duration;

use crate::robot_error::RobotErrors;
use crate::wire::Status;

/// Bytes that are no message.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum WireError {
    /// A message ended too early.
    #[error("a {message} of at least {expected} bytes was expected, {found} were found")]
    Short {
        /// Which message.
        message: &'static str,
        /// What was read up to here.
        expected: usize,
        /// What there is.
        found: usize,
    },
    /// A message goes on after its last field.
    #[error("a {message} of {expected} bytes was expected, {found} were found")]
    Long {
        /// Which message.
        message: &'static str,
        /// The size of the message.
        expected: usize,
        /// What there is.
        found: usize,
    },
    /// A header with an impossible size.
    #[error("a message of {min} to {max} bytes was expected, its header says {found}")]
    MessageSize {
        /// The header's own size.
        min: u32,
        /// The largest size.
        max: u32,
        /// What the header says.
        found: u32,
    },
    /// A number without a meaning.
    #[error("{found} is no {field}")]
    Value {
        /// Which field.
        field: &'static str,
        /// Its value.
        found: u32,
    },
}

/// What ends a call of the client or a server.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FciError {
    /// The system refused a socket.
    #[error("{action} {address}: {source}")]
    Socket {
        /// What was tried.
        action: &'static str,
        /// With which address.
        address: String,
        /// The system's reason.
        source: io::Error,
    },
    /// The peer closed the connection.
    #[error("{address} closed the connection")]
    Closed {
        /// Whose.
        address: SocketAddr,
    },
    /// The peer did not answer.
    #[error("no {what} from {address} within {} ms", waited.as_millis())]
    Timeout {
        /// What was awaited.
        what: &'static str,
        /// From where.
        address: SocketAddr,
        /// For how long.
        waited: Duration,
    },
    /// The robot speaks another version of the protocol.
    #[error("the {peer} speaks version {found} of the protocol, expected {expected}")]
    Version {
        /// Robot or hand.
        peer: &'static str,
        /// What this client speaks, in words.
        expected: String,
        /// What the peer speaks.
        found: u16,
    },
    /// Bytes that are no message.
    #[error("{address}: {source}")]
    Wire {
        /// From where.
        address: SocketAddr,
        /// What is wrong.
        source: WireError,
    },
    /// The robot refused a command.
    #[error("{command}: {status}")]
    Refused {
        /// Which command.
        command: &'static str,
        /// The robot's answer.
        status: Status,
    },
    /// A motion ended before its end.
    #[error("the motion was ended: {status}; errors: {errors}; {:.0} % of the last commands arrived in time", 100.0 * success_rate)]
    Motion {
        /// The robot's answer to the Move.
        status: Status,
        /// What the robot stopped for.
        errors: RobotErrors,
        /// Share of the last 100 commands that the robot had received in time.
        success_rate: f64,
    },
    /// A command that must not be sent.
    #[error("{field}: expected {expected}, found {found}")]
    Command {
        /// Which field of the command.
        field: &'static str,
        /// What it must be.
        expected: &'static str,
        /// What it is.
        found: String,
    },
    /// The simulated robot failed.
    #[error("the simulated robot: {0}")]
    Plant(String),
}

/// Results of this crate.
pub type Result<T> = std::result::Result<T, FciError>;
