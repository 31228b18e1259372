//! Frames of a wrong size in a camera's stream.

use image::RgbImage;

use crate::error::{CellError, Result};
use crate::perception::Perception;

/// Recognises frames of a wrong size: after a camera is switched to another size, neither the region nor the
/// calibration applies.
#[derive(Debug, Clone, Copy, Default)]
pub struct FrameSizes {
    /// Whether a frame of the right size has arrived.
    is_any_right: bool,
    /// The last wrong size; `None` after a frame of the right size.
    last_wrong: Option<(u32, u32)>,
}

/// Whether a frame has the right size.
#[derive(Debug)]
pub enum FrameSize {
    /// The frame can be searched.
    Right,
    /// The first frame of this wrong size in a row.
    Wrong(CellError),
    /// The same wrong size as that of the frame before.
    WrongAgain,
}

impl FrameSizes {
    /// Checks the next frame.
    ///
    /// # Errors
    /// The first frame of the stream has a wrong size: the following frames would have it as well.
    pub fn check(&mut self, detector: &Perception, picture: &RgbImage) -> Result<FrameSize> {
        let Err(error) = detector.check_picture(picture) else {
            *self = Self { is_any_right: true, last_wrong: None };
            return Ok(FrameSize::Right);
        };
        if !self.is_any_right {
            return Err(error);
        }
        let size = picture.dimensions();
        let is_again = self.last_wrong.replace(size) == Some(size);
        Ok(if is_again { FrameSize::WrongAgain } else { FrameSize::Wrong(error) })
    }
}
