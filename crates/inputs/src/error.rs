//! Errors that the caller can complete, for example with the name of an option.

use thiserror::Error;

/// The reason why the detector of a checkpoint is unknown.
#[derive(Debug, Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the messages say what the fields are")]
pub enum ConfigError {
    /// No preset has that name.
    #[error("expected a preset out of {expected}, found \"{found}\"")]
    UnknownPreset { expected: String, found: String },
    /// The file has this project's names, which are the same for every preset.
    #[error("expected a preset or a configuration for a file with this project's names")]
    OwnNames,
    /// No preset has this second stage.
    #[error("expected a keypoint head or a mask head, found both")]
    BothHeads,
}
