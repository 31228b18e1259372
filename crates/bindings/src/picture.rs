//! Pixels from arrays of other languages, and pictures from files.

use std::path::Path;

use image::RgbImage;
use sdg_demonstration::{ImageLimits, PixelFrame};

use crate::camera::Camera;
use crate::fault::{Fault, FaultKind, Result};

/// Order of an array's channels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PixelOrder {
    /// Red first.
    Rgb,
    /// Blue first, as in OpenCV.
    Bgr,
}

/// Height, width and number of channels of a checked array; grey has one channel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PixelShape {
    /// Height in pixels.
    pub height: u32,
    /// Width in pixels.
    pub width: u32,
    /// One or three.
    pub channels: usize,
}

impl PixelShape {
    /// Checks an array's shape: (height, width, 3), or (height, width) or (height, width, 1) for grey.
    ///
    /// # Errors
    /// Another shape, no pixels, or more pixels than allowed in a picture's file.
    pub fn new(shape: &[usize]) -> Result<Self> {
        let fault = |text: String| Err(Fault::new(FaultKind::Picture, text));
        let (height, width, channels) = match *shape {
            [height, width] => (height, width, 1),
            [height, width, channels @ (1 | 3)] => (height, width, channels),
            [_, _, found] => {
                return fault(format!("expected a picture of 3 channels, or of 1 for grey, found {found} channels"));
            }
            _ => {
                return fault(format!(
                    "expected an array of shape (height, width, 3), or (height, width) for grey, found {shape:?}"
                ));
            }
        };
        let max = ImageLimits::default().max_pixels;
        if height == 0 || width == 0 {
            return fault(format!("expected a picture of at least 1 × 1 pixels, found {width} × {height}"));
        }
        match (u32::try_from(height), u32::try_from(width)) {
            (Ok(height), Ok(width)) if u64::from(height) * u64::from(width) <= max => {
                Ok(Self { height, width, channels })
            }
            _ => fault(format!("expected a picture of at most {max} pixels, found {width} × {height}")),
        }
    }

    /// Copies the pixels to a picture; `at` returns the byte of a row, a column and a channel.
    pub fn copy(self, order: PixelOrder, at: impl Fn(usize, usize, usize) -> u8) -> RgbImage {
        let Self { height, width, channels } = self;
        let [red, green, blue] = match (channels, order) {
            (1, _) => [0; 3],
            (_, PixelOrder::Rgb) => [0, 1, 2],
            (_, PixelOrder::Bgr) => [2, 1, 0],
        };
        let mut bytes = Vec::with_capacity(3 * height as usize * width as usize);
        for row in 0..height as usize {
            for column in 0..width as usize {
                bytes.extend([at(row, column, red), at(row, column, green), at(row, column, blue)]);
            }
        }
        // The number of bytes follows from the size.
        RgbImage::from_raw(width, height, bytes).unwrap_or_default()
    }
}

/// Reads a picture of any supported format: upright, or with the sensor's orientation for a calibrated camera.
///
/// # Errors
/// The file cannot be read or is not a picture.
pub fn read_picture(path: &Path, camera: Option<&Camera>) -> Result<RgbImage> {
    let frame = if camera.is_some() { PixelFrame::Sensor } else { PixelFrame::Upright };
    Ok(sdg_inputs::read_image_in(path, frame)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn channels_are_put_in_order_and_grey_is_repeated() {
        let shape = PixelShape::new(&[1, 2, 3]).unwrap();
        let at = |_: usize, column: usize, channel: usize| (10 * column + channel) as u8;
        assert_eq!(shape.copy(PixelOrder::Rgb, at).into_raw(), [0, 1, 2, 10, 11, 12]);
        assert_eq!(shape.copy(PixelOrder::Bgr, at).into_raw(), [2, 1, 0, 12, 11, 10]);
        assert_eq!(PixelShape::new(&[1, 2]).unwrap().copy(PixelOrder::Bgr, at).into_raw(), [0, 0, 0, 10, 10, 10]);
    }

    #[test]
    fn other_shapes_are_named() {
        for (shape, words) in [
            (&[4][..], "found [4]"),
            (&[4, 4, 4], "found 4 channels"),
            (&[0, 4, 3], "found 4 × 0"),
            (&[1 << 40, 4, 3], "found 4 × 1099511627776"),
        ] {
            let fault = PixelShape::new(shape).unwrap_err();
            assert!(fault.kind == FaultKind::Picture && fault.text.ends_with(words), "{fault}");
        }
    }
}
