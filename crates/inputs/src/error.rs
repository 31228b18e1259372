//! Errors that the caller can complete, for example with the name of an option.

use thiserror::Error;

/// Why the detector of a checkpoint is unknown.
#[derive(Debug, Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the messages say what the fields are")]
pub enum ConfigError {
    /// No preset has that name.
    #[error("expected a preset out of {expected}, found \"{found}\"")]
    UnknownPreset { expected: String, found: String },
    /// Names of this project, which every preset's checkpoint has.
    #[error("expected a preset or a configuration for a file with this project's names")]
    OwnNames,
    /// A second stage that no preset has.
    #[error("expected a keypoint head or a mask head, found both")]
    BothHeads,
}
