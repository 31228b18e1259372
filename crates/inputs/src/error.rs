//! Errors that a caller can help with: its own words follow, such as the option to give.

use thiserror::Error;

/// Why it is not known which detector a checkpoint is for.
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
