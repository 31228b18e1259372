//! Errors of pictures, most with the expected and the found value.

use thiserror::Error;

/// The reason why a picture was rejected.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the messages explain the fields")]
pub enum PictureError {
    /// The format of the bytes is not supported.
    #[error("not a readable image: expected a {expected} file, found {found}")]
    NotAnImage {
        /// The formats that this build reads.
        expected: String,
        /// A description of the bytes.
        found: String,
    },
    /// The image is truncated or damaged.
    #[error("damaged {format} image: {reason}")]
    DamagedImage { format: &'static str, reason: String },
    /// An unsupported variant of a format, and what the user can do.
    #[error("unsupported kind of {format} image: {found}: {remedy}")]
    UnsupportedKind { format: &'static str, found: String, remedy: &'static str },
    /// Width or height is zero.
    #[error("empty image: expected at least 1×1 pixels, found {width}×{height}")]
    EmptyImage { width: u32, height: u32 },
    /// More pixels than the limit; detected in the header, before memory for the pixels is allocated.
    #[error(
        "enormous image: expected at most {} megapixels, found {width}×{height} = {} megapixels; save it with half the width and height",
        max_pixels / 1_000_000,
        u64::from(*.width) * u64::from(*.height) / 1_000_000
    )]
    EnormousImage {
        /// Width according to the file's header.
        width: u32,
        /// Height according to the file's header.
        height: u32,
        max_pixels: u64,
    },
    /// An Exif orientation rotates a photo whose marks must be in the pixels of a calibrated camera.
    #[error(
        "expected a photo of the calibrated camera without an Exif orientation that rotates it, found one with it: the \
         calibration is for the sensor's pixels; remove the tag (exiftool -Orientation= FILE), check whether the marks \
         still fit, and mark it again if not"
    )]
    TurnedByExif,
}
