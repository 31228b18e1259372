//! What can be wrong with a picture, each with what was expected and what was found.

use thiserror::Error;

/// Why a picture was refused.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the messages say what the fields are")]
pub enum PictureError {
    /// The bytes are of no format that is read.
    #[error("not a readable image: expected a {expected} file, found {found}")]
    NotAnImage {
        /// The formats that this build reads.
        expected: String,
        /// What the bytes look like.
        found: String,
    },
    /// The image starts well and then breaks off or is damaged, or is of a kind that is not read.
    #[error("damaged {format} image: {reason}")]
    DamagedImage { format: &'static str, reason: String },
    /// A kind of a format that is not read, and what to do.
    #[error("{format} image of a kind that is not read: {found}: {remedy}")]
    UnsupportedKind { format: &'static str, found: String, remedy: &'static str },
    /// Width or height is zero.
    #[error("empty image: expected at least 1×1 pixels, found {width}×{height}")]
    EmptyImage { width: u32, height: u32 },
    /// More pixels than the limit allows; found in the header, before anything was allocated.
    #[error(
        "enormous image: expected at most {} megapixels, found {width}×{height} = {} megapixels; save it with half the width and height",
        max_pixels / 1_000_000,
        u64::from(*.width) * u64::from(*.height) / 1_000_000
    )]
    EnormousImage {
        /// Pixels across, by the file's header.
        width: u32,
        /// Pixels down, by the file's header.
        height: u32,
        max_pixels: u64,
    },
}
