//! Errors of the inputs of this crate.

use thiserror::Error;

/// An input with which the orientation CNN cannot work. Each message gives the expected and the found value.
#[derive(Debug, Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the messages explain the fields")]
pub enum OrientationError {
    /// A setting is outside its range, or two settings contradict each other.
    #[error("orientation CNN: {field} must be {expected}, found {found}")]
    Config { field: &'static str, expected: String, found: String },
    /// An image has no pixels.
    #[error("an image for cropping needs at least 1x1 pixels, found {width}x{height}")]
    EmptyImage { width: u32, height: u32 },
    /// A box that gives no crop.
    #[error("a box for cropping needs finite corners and a positive area, found ({x1}, {y1}) to ({x2}, {y2})")]
    BadBox { x1: f64, y1: f64, x2: f64, y2: f64 },
    /// A crop whose size differs from the network's input.
    #[error("the orientation CNN reads crops of {expected}x{expected} pixels, found {width}x{height}")]
    CropSize { expected: u32, width: u32, height: u32 },
}

/// Result of the fallible functions of this crate.
pub type Result<T> = std::result::Result<T, OrientationError>;

/// Rejects a setting of the network, or of its training, that is out of range.
///
/// # Errors
/// [`OrientationError::Config`].
pub fn check_setting(holds: bool, field: &'static str, expected: &str, found: impl ToString) -> Result<()> {
    if holds {
        return Ok(());
    }
    Err(OrientationError::Config { field, expected: expected.to_owned(), found: found.to_string() })
}
