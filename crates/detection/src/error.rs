//! Errors of the inputs of this crate.

use thiserror::Error;

/// An input with which the detector cannot work. Each message gives the expected and the found value.
#[derive(Debug, Error, Clone, PartialEq)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the messages explain the fields")]
pub enum DetectionError {
    /// A configuration value is outside its range, or two values contradict each other.
    #[error("detector configuration: {field} must be {expected}, found {found}")]
    Config {
        /// Path of the field in [`crate::RcnnConfig`].
        field: &'static str,
        /// The accepted values.
        expected: String,
        found: String,
    },
    /// A configuration cannot be read.
    #[error(
        "detector configuration: expected all values, or `kind` and the values that differ from its preset: {reason}"
    )]
    ConfigFile {
        /// The unreadable part, and its position.
        reason: String,
    },
    /// A batch in which the numbers of targets and images differ.
    #[error("a batch needs one target per image: expected {expected} targets, found {found}")]
    BatchSize { expected: usize, found: usize },
    /// The batch is empty.
    #[error("a training batch needs at least one image, found none")]
    EmptyBatch,
    /// A target contradicts itself or the configuration.
    #[error("target {image_idx}: {field} expected {expected}, found {found}")]
    Target {
        /// Index of the image in the batch.
        image_idx: usize,
        /// The part of the target.
        field: &'static str,
        expected: String,
        found: String,
    },
    /// An image has no pixels.
    #[error("an image needs at least 1x1 pixels, found {width}x{height}")]
    EmptyImage { width: u32, height: u32 },
}

/// Result of the fallible functions of this crate.
pub type Result<T> = std::result::Result<T, DetectionError>;
