//! Pictures from disk and from standard input.

use std::path::Path;

use anyhow::{Context, Result, bail};
use image::RgbImage;
use sdg_demonstration::{ImageLimits, PictureError, PixelFrame, decode_image_in, is_turned_by_exif};
use sdg_files::{read, read_bounded};

use crate::error_line::one_line;

/// Maximum size of a picture's file.
const MAX_IMAGE_BYTES: u64 = 256 << 20;

/// Reads a picture of any format of [`decode_image_in`], rotated upright.
pub fn read_image(path: &Path) -> Result<RgbImage> {
    read_image_in(path, PixelFrame::Upright)
}

/// Like [`read_image`], with the orientation of the pixels given; a calibration needs the sensor's.
pub fn read_image_in(path: &Path, frame: PixelFrame) -> Result<RgbImage> {
    let bytes = read(path, MAX_IMAGE_BYTES)?;
    decode_image_in(&bytes, &ImageLimits::default(), frame).with_context(|| path.display().to_string())
}

/// The stored pixels of a photo, if an Exif orientation rotates it.
pub fn read_sensor_pixels_if_turned(photo: &Path) -> Result<Option<RgbImage>> {
    let is_turned = is_turned_by_exif(&read(photo, MAX_IMAGE_BYTES)?);
    is_turned.then(|| read_image_in(photo, PixelFrame::Sensor)).transpose()
}

/// Checks that no Exif orientation rotates a photo whose marks must be in the pixels of a calibrated camera: the frame
/// of such marks would be unknown.
///
/// # Errors
/// The photo is rotated, or its file cannot be read.
pub fn check_is_not_turned(photo: &Path) -> Result<()> {
    if is_turned_by_exif(&read(photo, MAX_IMAGE_BYTES)?) {
        bail!("{}: {}", photo.display(), PictureError::TurnedByExif);
    }
    Ok(())
}

/// Extensions of picture formats that cannot be read; such a file gives an error and is not skipped.
pub const UNREADABLE_EXTENSIONS: [&str; 4] = ["heic", "heif", "avif", "gif"];

/// The error of a file with one of the [`UNREADABLE_EXTENSIONS`]; `None` for other files.
pub fn why_unreadable(path: &Path) -> Option<String> {
    sdg_files::has_extension(path, &UNREADABLE_EXTENSIONS)
        .then(|| read_image(path).err().map(|error| one_line(&error)).unwrap_or_default())
}

/// Reads a picture from standard input until its end.
pub fn read_standard_input_image(frame: PixelFrame) -> Result<RgbImage> {
    let name = Path::new("standard input");
    let bytes = read_bounded(std::io::stdin().lock(), name, MAX_IMAGE_BYTES)?;
    decode_image_in(&bytes, &ImageLimits::default(), frame).with_context(|| name.display().to_string())
}
