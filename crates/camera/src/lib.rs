//! Live pictures: one trait, and the cameras behind it.
#![forbid(unsafe_code)]
#![cfg_attr(test, allow(clippy::unwrap_used))]

mod error;

use std::sync::Arc;
use std::time::SystemTime;

use image::RgbImage;

pub use error::CameraError;

/// A picture, when it was taken and by which camera.
#[derive(Debug, Clone)]
pub struct Frame {
    /// The picture.
    pub picture: RgbImage,
    /// Counted by the camera from 0; a gap means frames that were not delivered.
    pub number: u64,
    /// When it was taken; where the camera does not say, when it arrived.
    pub captured: SystemTime,
    /// The camera's address, as it was given.
    pub camera: Arc<str>,
}

/// A source of frames.
pub trait Camera: Send {
    /// Waits for the next frame; `None` where there will be none, as at the end of a folder.
    ///
    /// # Errors
    /// What went wrong with this frame or this camera. After an error that [`CameraError::is_passing`] the next call goes on.
    fn next_frame(&mut self) -> Result<Option<Frame>, CameraError>;
}
