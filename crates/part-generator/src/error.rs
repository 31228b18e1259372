//! Errors of the configuration of scenes.

/// The reason why scenes could not be set up.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the messages explain the fields")]
pub enum GeneratorError {
    /// No part was given.
    #[error("expected at least one part, found none")]
    NoPart,
    /// A picture too small or too large.
    #[error("expected pictures of 32 to 4096 pixels a side, found {width}x{height}")]
    PictureSize { width: u32, height: u32 },
    /// A value of the configuration outside its range.
    #[error("expected {name} {expected}, found {found}")]
    InvalidConfig {
        name: &'static str,
        /// The accepted range, in words.
        expected: &'static str,
        found: f64,
    },
}

/// Result of this crate's functions.
pub type Result<T> = std::result::Result<T, GeneratorError>;
