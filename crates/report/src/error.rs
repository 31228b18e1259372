//! The error type of this crate.

use std::path::PathBuf;

use thiserror::Error;

/// The reason why a report, an animation or a file cannot be made.
#[derive(Debug, Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the messages say what the fields are")]
pub enum ReportError {
    /// A folder is missing and could not be created.
    #[error("cannot create the folder {}: {source}", path.display())]
    Folder { path: PathBuf, source: std::io::Error },
    /// The file of the page cannot be written.
    #[error(transparent)]
    File(#[from] sdg_files::FileError),
    /// The animation has no frames.
    #[error("an animation needs at least one frame, found none")]
    NoFrames,
    /// A frame or picture has no pixels, or is too large for its format.
    #[error("{what}: expected between 1x1 and {limit}x{limit} pixels, found {width}x{height}")]
    PictureSize {
        what: &'static str,
        width: u32,
        height: u32,
        /// Maximum side of the format.
        limit: u32,
    },
    /// The size of a frame differs from the first one's.
    #[error(
        "frame {frame_idx} of an animation: expected {}x{} pixels as in the first frame, found {}x{}",
        expected.0, expected.1, found.0, found.1
    )]
    FrameSize {
        /// Index of the frame, from 0.
        frame_idx: usize,
        /// Width and height of the first frame.
        expected: (u32, u32),
        /// Width and height of this frame.
        found: (u32, u32),
    },
    /// The JPEG encoder rejected a picture.
    #[error("cannot encode a picture of {width}x{height} pixels as JPEG: {source}")]
    Jpeg { width: u32, height: u32, source: image::ImageError },
    /// The GIF encoder rejected a frame.
    #[error("cannot encode an animation as GIF: {source}")]
    Gif { source: gif::EncodingError },
}
