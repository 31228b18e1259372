//! Errors that the caller can complete, for example with the name of an option.

use std::path::PathBuf;

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

/// A text that does not name a photo and its marks.
#[derive(Debug, Error)]
#[error("expected IMAGE or IMAGE:ANNOTATION, found {found}")]
#[allow(missing_docs, reason = "the message says what the field is")]
pub struct NotAPair {
    pub found: String,
}

/// The reason why the image of an annotation file must be given.
#[derive(Debug, Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the messages say what the fields are")]
pub enum ImageError {
    /// The file does not state a size.
    #[error("{} does not state the size of its image; expected the image", path.display())]
    NoSize { path: PathBuf },
    /// The file has several images.
    #[error("expected one of the {count} images of {}", path.display())]
    Several { count: usize, path: PathBuf },
}
