//! One connection to a camera: pictures until it ends.

use std::time::{Instant, SystemTime};

use image::RgbImage;

use crate::error::CameraError;
use crate::fault::Fault;

/// What a connection gave.
#[derive(Debug)]
pub(crate) struct Taken {
    pub(crate) picture: RgbImage,
    pub(crate) captured: SystemTime,
    /// Frames before it that were thrown away because newer ones had come.
    pub(crate) num_skipped: u64,
}

impl Taken {
    /// A picture that arrived now, with none thrown away before it.
    pub(crate) fn now(picture: RgbImage) -> Self {
        Self { picture, captured: SystemTime::now(), num_skipped: 0 }
    }
}

/// Why a connection gave no picture.
#[derive(Debug)]
pub(crate) enum Missing {
    /// Nothing until the deadline; the connection stands.
    Late,
    /// This picture is lost, the connection stands.
    Torn(String),
    /// The connection is lost.
    Gone(String),
    /// The camera ended; to open it again would end likewise.
    Ended(String),
}

/// One connection to a camera.
pub(crate) trait Source: Send {
    /// Waits for a picture until the deadline; `None` where there will be none.
    fn take(&mut self, deadline: Instant) -> Result<Option<Taken>, Missing>;

    /// As [`Camera::is_on_request`](crate::Camera::is_on_request).
    fn is_on_request(&self) -> bool {
        false
    }
}

/// An error that carries a fault.
pub(crate) fn fault(camera: &str, fault: Fault) -> CameraError {
    CameraError::Fault { camera: camera.to_owned(), fault }
}
