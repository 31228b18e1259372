//! Faults of an open camera.

use std::fmt;

/// A fault of a camera or a frame.
///
/// | fault | where |
/// |---|---|
/// | `Stale`, `Torn`, `Gone` | [`CameraError::Fault`](crate::CameraError::Fault): there is no picture |
/// | `Frozen`, `Black`, `OtherSize`, `Back` | [`Frame::faults`](crate::Frame::faults), beside the picture |
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Fault {
    /// No frame within the stall timeout.
    Stale {
        /// Seconds since the last frame, or since the camera was opened.
        silent_secs: f64,
    },
    /// A frame is incomplete or cannot be decoded; it is not delivered.
    Torn {
        /// A description of the data received.
        found: String,
    },
    /// The connection is lost; each further call may try to reopen it.
    Gone {
        /// The cause of the loss, or why reopening failed.
        why: String,
    },
    /// Bit-identical frames many times in a row. The noise of a real sensor differs in every frame.
    Frozen {
        /// Number of identical frames in a row, including this one.
        num_frames: u32,
    },
    /// Nearly all pixels are close to 0, as with a lens cap.
    Black,
    /// The picture's size differs from the previous frame's.
    OtherSize {
        /// Width and height of the previous frame.
        before: (u32, u32),
        /// Width and height of this frame.
        now: (u32, u32),
    },
    /// The first frame after [`Fault::Gone`].
    Back {
        /// Seconds without a connection.
        away_secs: f64,
    },
}

impl Fault {
    /// The name in JSON, in lower case with hyphens.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Stale { .. } => "stale",
            Self::Torn { .. } => "torn",
            Self::Gone { .. } => "gone",
            Self::Frozen { .. } => "frozen",
            Self::Black => "black",
            Self::OtherSize { .. } => "other-size",
            Self::Back { .. } => "back",
        }
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Stale { silent_secs } => write!(f, "stale: no frame for {silent_secs:.1} s"),
            Self::Torn { found } => write!(f, "torn: expected a whole picture, found {found}"),
            Self::Gone { why } => write!(f, "gone: {why}"),
            Self::Frozen { num_frames } => write!(f, "frozen: the same picture {num_frames} times in a row"),
            Self::Black => write!(f, "black: nearly all pixels are close to 0"),
            Self::OtherSize { before, now } => {
                write!(f, "other size: {} × {} pixels, before {} × {}", now.0, now.1, before.0, before.1)
            }
            Self::Back { away_secs } => write!(f, "back after {away_secs:.1} s"),
        }
    }
}
