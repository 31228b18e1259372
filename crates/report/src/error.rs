//! What can go wrong between a filled report and its file.

use std::path::PathBuf;

use thiserror::Error;

/// A report, an animation or a file that could not be made.
#[derive(Debug, Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the messages say what the fields are")]
pub enum ReportError {
    /// A folder is missing and could not be created.
    #[error("cannot create the folder {}: {source}", path.display())]
    Folder { path: PathBuf, source: std::io::Error },
    /// The page's file could not be written.
    #[error(transparent)]
    File(#[from] sdg_files::FileError),
    /// An animation without a frame.
    #[error("an animation needs at least one frame, found none")]
    NoFrames,
    /// A frame or picture without pixels, or one too large for its format.
    #[error("{what}: expected between 1x1 and {limit}x{limit} pixels, found {width}x{height}")]
    PictureSize {
        what: &'static str,
        width: u32,
        height: u32,
        /// The most that the format takes on a side.
        limit: u32,
    },
    /// A frame of another size than the first one.
    #[error(
        "frame {frame_idx} of an animation: expected {}x{} pixels as in the first frame, found {}x{}",
        expected.0, expected.1, found.0, found.1
    )]
    FrameSize {
        /// The frame, counted from 0.
        frame_idx: usize,
        /// Width and height of the first frame.
        expected: (u32, u32),
        /// Width and height of this one.
        found: (u32, u32),
    },
    /// The JPEG encoder refused a picture.
    #[error("cannot encode a picture of {width}x{height} pixels as JPEG: {source}")]
    Jpeg { width: u32, height: u32, source: image::ImageError },
    /// The GIF encoder refused a frame.
    #[error("cannot encode an animation as GIF: {source}")]
    Gif { source: gif::EncodingError },
}
