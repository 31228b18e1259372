//! What can go wrong with ROS 2, with what was expected and what was found.

use crate::cdr::CdrError;

/// Errors of this crate.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the messages say what the fields are")]
pub enum RosError {
    /// Text that is no name.
    #[error("a name of ROS: expected {expected}, found \"{found}\"")]
    Name { expected: String, found: String },
    /// Bytes that are no message of the topic's type.
    #[error("{topic}: malformed message: {source}")]
    Malformed { topic: String, source: CdrError },
    /// A picture that cannot be read.
    #[error("{topic}: {why}")]
    Picture { topic: String, why: PictureError },
    /// A camera_info that is of no use.
    #[error("camera_info: expected {expected}, found {found}")]
    CameraInfo { expected: String, found: String },
    /// Frames without a connection, or an old one.
    #[error("no transform from \"{source_frame}\" to \"{target_frame}\": {why}")]
    Transform { target_frame: String, source_frame: String, why: String },
    /// The network.
    #[error("{what}: {why}")]
    Network { what: String, why: String },
}

/// Why a message's picture cannot be read.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("expected {expected}, found {found}")]
pub struct PictureError {
    /// What can be read.
    pub expected: String,
    /// What came.
    pub found: String,
}

impl PictureError {
    /// What came, and what should have: for faults of cameras, which expect a picture.
    #[cfg(feature = "dds")]
    pub(crate) fn found_in_words(&self) -> String {
        format!("{} where {} was expected", self.found, self.expected)
    }
}
