//! Errors of ROS 2.

use crate::cdr::CdrError;

/// Errors of this crate.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the messages explain the fields")]
pub enum RosError {
    /// Text that is not a valid name.
    #[error("a name of ROS: expected {expected}, found \"{found}\"")]
    Name { expected: String, found: String },
    /// Bytes that are not a message of the topic's type.
    #[error("{topic}: malformed message: {source}")]
    Malformed { topic: String, source: CdrError },
    /// A picture that cannot be read.
    #[error("{topic}: {why}")]
    Picture { topic: String, why: PictureError },
    /// An unusable camera_info.
    #[error("camera_info: expected {expected}, found {found}")]
    CameraInfo { expected: String, found: String },
    /// No usable transform between two frames.
    #[error("no transform from \"{source_frame}\" to \"{target_frame}\": {why}")]
    Transform { target_frame: String, source_frame: String, why: String },
    /// The system's clock was set back, so that RustDDS receives no best-effort messages for as long.
    #[error("{topic}: the clock was set back by {secs:.0} s: restart the program")]
    ClockSetBack { topic: String, secs: f64 },
    /// The network reported an error.
    #[error("{what}: {why}")]
    Network { what: String, why: String },
}

/// The reason why a message's picture cannot be read.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("expected {expected}, found {found}")]
pub struct PictureError {
    /// The supported content.
    pub expected: String,
    /// The received content.
    pub found: String,
}

impl PictureError {
    /// The received and the expected content as one text, for camera errors.
    #[cfg(feature = "dds")]
    pub(crate) fn found_in_words(&self) -> String {
        format!("{} where {} was expected", self.found, self.expected)
    }
}
