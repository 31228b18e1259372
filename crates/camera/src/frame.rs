//! A picture with its origin, and the trait implemented by all cameras.

use std::fmt;
use std::sync::Arc;
use std::time::{SystemTime, UNIX_EPOCH};

use image::RgbImage;

use crate::error::CameraError;
use crate::fault::Fault;

/// A picture with its capture time and camera.
#[derive(Clone)]
pub struct Frame {
    /// The pixels, decoded to RGB.
    pub picture: RgbImage,
    /// Number assigned by the camera, from 0; a gap means that frames were not delivered.
    pub number: u64,
    /// Capture time, or the arrival time if the camera provides none; for a picture requested over HTTP, the time before
    /// the request.
    pub captured: SystemTime,
    /// The camera's address as given, without the password.
    pub camera: Arc<str>,
    /// Faults of this frame; empty if there are none.
    pub faults: Vec<Fault>,
}

impl Frame {
    /// A frame without faults, captured now.
    pub fn new(picture: RgbImage, number: u64, camera: Arc<str>) -> Self {
        Self { picture, number, captured: SystemTime::now(), camera, faults: Vec::new() }
    }

    /// Capture time in seconds since 1970.
    pub fn captured_unix_secs(&self) -> f64 {
        self.captured.duration_since(UNIX_EPOCH).unwrap_or_default().as_secs_f64()
    }
}

impl fmt::Debug for Frame {
    /// Prints the frame without its pixels.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (width, height) = self.picture.dimensions();
        write!(f, "frame {} of {}, {width} × {height} pixels, faults {:?}", self.number, self.camera, self.faults)
    }
}

/// A source of frames.
pub trait Camera: Send {
    /// Waits for the next frame; `None` if there are no more, as at the end of a folder.
    ///
    /// # Errors
    /// A fault of this frame or camera. After an error with [`CameraError::is_passing`], the next call tries again.
    fn next_frame(&mut self) -> Result<Option<Frame>, CameraError>;

    /// Whether pictures are taken or read only on request, so that no picture becomes old or is lost while the previous
    /// one is processed.
    fn is_on_request(&self) -> bool {
        false
    }
}

impl<C: Camera + ?Sized> Camera for Box<C> {
    fn next_frame(&mut self) -> Result<Option<Frame>, CameraError> {
        (**self).next_frame()
    }

    fn is_on_request(&self) -> bool {
        (**self).is_on_request()
    }
}

/// The mean of all channels of all pixels, 0 to 255; 0 for a picture without pixels.
pub fn mean_brightness(picture: &RgbImage) -> f64 {
    let bytes = picture.as_raw();
    // Sums of 4 KiB rows fit into u32, whose addition is four times as fast as that of u64.
    let sum: u64 =
        bytes.chunks(1 << 12).map(|row| u64::from(row.iter().map(|&byte| u32::from(byte)).sum::<u32>())).sum();
    sum as f64 / bytes.len().max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::Rgb;

    #[test]
    fn brightness_is_the_mean_of_all_channels() {
        let mut picture = RgbImage::from_pixel(3000, 2, Rgb([10, 20, 30]));
        assert_eq!(mean_brightness(&picture), 20.0);
        picture.put_pixel(0, 0, Rgb([10, 20, 30 + 180]));
        assert_eq!(mean_brightness(&picture), 20.0 + 180.0 / 18000.0);
        assert_eq!(mean_brightness(&RgbImage::new(0, 0)), 0.0);
    }
}
