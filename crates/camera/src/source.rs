//! One connection to a camera, which delivers pictures until it ends.

use std::time::{Instant, SystemTime};

use image::RgbImage;

use crate::error::CameraError;
use crate::fault::Fault;

/// A picture of a connection.
#[derive(Debug)]
pub(crate) struct Taken {
    pub(crate) picture: RgbImage,
    pub(crate) captured: SystemTime,
    /// Number of frames before this one that were discarded because newer ones had arrived.
    pub(crate) num_skipped: u64,
}

impl Taken {
    /// A picture that has just arrived, with no frame discarded before it.
    pub(crate) fn now(picture: RgbImage) -> Self {
        Self { picture, captured: SystemTime::now(), num_skipped: 0 }
    }
}

/// The reason why a connection gave no picture.
#[derive(Debug)]
pub(crate) enum Missing {
    /// No complete picture until the deadline; the connection is still open.
    Late,
    /// This picture is lost; the connection is still open.
    Torn(String),
    /// The connection is lost.
    Gone(String),
    /// The connection ended before its first picture; unless an earlier one delivered pictures, the next would end in
    /// the same way.
    Ended(String),
}

/// One connection to a camera.
pub(crate) trait Source: Send {
    /// Waits for a picture until the deadline; `None` if there are no more.
    fn take(&mut self, deadline: Instant) -> Result<Option<Taken>, Missing>;

    /// See [`Camera::is_on_request`](crate::Camera::is_on_request).
    fn is_on_request(&self) -> bool {
        false
    }

    /// Whether there is a connection that can be lost. Files have none: a new source would begin again with the first.
    fn has_connection(&self) -> bool {
        true
    }
}

/// A [`CameraError::Fault`] of this camera.
pub(crate) fn fault(camera: &str, fault: Fault) -> CameraError {
    CameraError::Fault { camera: camera.to_owned(), fault }
}
