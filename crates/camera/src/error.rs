//! The error type of this crate.

use crate::fault::Fault;

/// The reason why there is no frame.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the messages say what the fields are")]
pub enum CameraError {
    /// The text is not a camera address.
    #[error("expected {expected}, found \"{found}\"")]
    Address {
        /// The expected form.
        expected: String,
        found: String,
    },
    /// The address must be opened by another crate.
    #[error("{address}: expected a caller that opens simulated cameras and topics of ROS 2; the crate camera does not")]
    OpenedElsewhere { address: String },
    /// The camera cannot be opened.
    #[error("{address}: {why}")]
    Open {
        /// The address, without a password.
        address: String,
        /// What was expected and found.
        why: String,
    },
    /// The camera does not have the setting, or rejects it.
    #[error("{address}: expected a camera with the setting {setting}, found {found}")]
    Setting {
        address: String,
        /// The setting.
        setting: &'static str,
        found: String,
    },
    /// A temporary fault; the next call continues.
    #[error("{camera}: {fault}")]
    Fault {
        /// The camera's address, without a password.
        camera: String,
        fault: Fault,
    },
    /// The camera has ended permanently: if reopened, it would end in the same way.
    #[error("{camera}: {why}")]
    Ended { camera: String, why: String },
    /// The port of 127.0.0.1 cannot be bound.
    #[error("expected a free port of 127.0.0.1, found port {port}: {source}")]
    Port {
        /// The port, or 0 for any free port.
        port: u16,
        source: std::io::Error,
    },
}

impl CameraError {
    /// Whether the next call may deliver a frame again.
    pub fn is_passing(&self) -> bool {
        self.fault().is_some()
    }

    /// The fault, if the error is [`CameraError::Fault`].
    pub fn fault(&self) -> Option<&Fault> {
        match self {
            Self::Fault { fault, .. } => Some(fault),
            _ => None,
        }
    }
}
