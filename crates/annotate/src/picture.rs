//! The picture files that the page may show, and no other files.

use std::fs;
use std::io::Cursor;
use std::path::{Path, PathBuf};

use image::{ImageFormat, RgbImage};
use sdg_demonstration::{ImageLimits, PictureError, PixelFrame, decode_image_in, is_turned_by_exif};
use sdg_files::is_same_path;

use crate::error::{Error, Result};
use crate::names::{file_name, is_picture_name, natural_order};

/// Maximum size of a photo's file.
pub const MAX_PICTURE_BYTES: u64 = 64 << 20;
/// JPEG quality of pictures encoded for the page.
const JPEG_QUALITY: u8 = 90;

/// A readable picture file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Picture {
    /// Path of the file.
    pub path: PathBuf,
    /// Name shown on the page.
    pub name: String,
    /// Width and height of the picture, in pixels.
    pub size: [u32; 2],
    /// Orientation of the pixels.
    pub frame: PixelFrame,
}

impl Picture {
    /// Whether the picture's file is at this path, in any spelling.
    pub fn is_at(&self, path: &Path) -> bool {
        is_same_path(&self.path, path)
    }

    /// Reads and decodes the file once, so that any error is reported now.
    ///
    /// # Errors
    /// The file cannot be read or is not a picture.
    pub fn open(path: &Path, frame: PixelFrame) -> Result<Self> {
        let name = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned();
        let image = decode(&read(path)?, &path.display().to_string(), frame)?;
        Ok(Self { path: path.to_owned(), name, size: [image.width(), image.height()], frame })
    }

    /// Decodes a photo's bytes once, so that invalid photos are rejected before they are written. `size` is that of a
    /// calibrated camera's pictures.
    ///
    /// # Errors
    /// The bytes are not a picture, or an Exif orientation rotates a photo of a calibrated camera or it has another
    /// size.
    pub fn check_photo(bytes: &[u8], name: &str, frame: PixelFrame, size: Option<[u32; 2]>) -> Result<()> {
        if frame == PixelFrame::Sensor {
            check_is_not_turned(bytes, name)?;
        }
        let image = decode(bytes, name, frame)?;
        check_size([image.width(), image.height()], name, size)
    }

    /// Checks that the picture can be from the calibrated camera, whose pictures have the size `expected`.
    ///
    /// # Errors
    /// The picture has another size.
    pub fn check_size(&self, expected: Option<[u32; 2]>) -> Result<()> {
        check_size(self.size, &self.name, expected)
    }

    /// Checks that the picture can be a photo with marks: if an Exif orientation rotates a picture of a calibrated
    /// camera, it would be unknown whether the marks in its file refer to the sensor's pixels.
    ///
    /// # Errors
    /// The file has become unreadable, or an Exif orientation rotates a photo of a calibrated camera.
    pub fn check_is_markable(&self) -> Result<()> {
        match self.frame {
            PixelFrame::Upright => Ok(()),
            PixelFrame::Sensor => check_is_not_turned(&read(&self.path)?, &self.path.display().to_string()),
        }
    }

    /// The pixels, in the picture's frame.
    ///
    /// # Errors
    /// The file has become unreadable, or its picture has another size now.
    pub fn pixels(&self) -> Result<RgbImage> {
        let image = decode(&read(&self.path)?, &self.name, self.frame)?;
        if [image.width(), image.height()] == self.size {
            return Ok(image);
        }
        let (annotated, found) = (self.size, [image.width(), image.height()]);
        Err(Error::Demonstration {
            name: self.name.clone(),
            source: sdg_demonstration::Error::OtherImageSize { annotated, image: found },
        })
    }

    /// Bytes for a browser, with the same pixels, and their media type: the file itself if it is a PNG or JPEG without
    /// an Exif orientation that rotates it, otherwise a JPEG.
    ///
    /// # Errors
    /// The file has become unreadable.
    pub fn for_browser(&self) -> Result<(Vec<u8>, &'static str)> {
        let bytes = read(&self.path)?;
        let media_type = match image::guess_format(&bytes) {
            Ok(ImageFormat::Png) => Some("image/png"),
            Ok(ImageFormat::Jpeg) => Some("image/jpeg"),
            _ => None,
        };
        match media_type {
            Some(media_type) if !is_turned_by_exif(&bytes) => Ok((bytes, media_type)),
            _ => Ok((jpeg(&decode(&bytes, &self.name, self.frame)?), "image/jpeg")),
        }
    }
}

/// The pictures in a folder, in the natural order of their names; subfolders are ignored.
///
/// # Errors
/// The folder cannot be listed.
pub fn pictures_in(folder: &Path) -> Result<Vec<PathBuf>> {
    let failed = || Error::file(folder, "cannot list this folder");
    let mut paths = Vec::new();
    for entry in fs::read_dir(folder).map_err(failed())? {
        let path = entry.map_err(failed())?.path();
        if path.is_file() && is_picture_name(&path) {
            paths.push(path);
        }
    }
    paths.sort_by(|a, b| natural_order(&file_name(a), &file_name(b)));
    Ok(paths)
}

/// The usual extension of a picture of this format; `jpg` for other bytes, which cannot be opened as a picture.
pub fn extension_of(bytes: &[u8]) -> &'static str {
    let format = image::guess_format(bytes).ok();
    format.and_then(|format| format.extensions_str().first().copied()).unwrap_or("jpg")
}

/// The picture as JPEG, for the page to show.
pub fn jpeg(image: &RgbImage) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = image::codecs::jpeg::JpegEncoder::new_with_quality(&mut bytes, JPEG_QUALITY);
    // Writing to memory fails only for pictures above JPEG's limit of 65535 pixels per side, which no demonstration
    // has.
    match encoder.encode_image(image) {
        Ok(()) => bytes,
        Err(_) => Vec::new(),
    }
}

/// The picture as PNG, without loss.
///
/// # Errors
/// The picture has no pixels.
pub fn png(image: &RgbImage) -> Result<Vec<u8>> {
    let mut bytes = Cursor::new(Vec::new());
    image.write_to(&mut bytes, ImageFormat::Png).map_err(|error| Error::Camera {
        expected: "a picture that can be written as PNG",
        found: error.to_string(),
    })?;
    Ok(bytes.into_inner())
}

fn read(path: &Path) -> Result<Vec<u8>> {
    let failed = || Error::file(path, "cannot read");
    let found = fs::metadata(path).map_err(failed())?.len();
    if found > MAX_PICTURE_BYTES {
        return Err(Error::TooLarge { path: path.to_owned(), most: MAX_PICTURE_BYTES, found });
    }
    fs::read(path).map_err(failed())
}

fn decode(bytes: &[u8], name: &str, frame: PixelFrame) -> Result<RgbImage> {
    decode_image_in(bytes, &ImageLimits::default(), frame).map_err(|source| refused(name, source))
}

fn check_is_not_turned(bytes: &[u8], name: &str) -> Result<()> {
    if is_turned_by_exif(bytes) { Err(refused(name, PictureError::TurnedByExif)) } else { Ok(()) }
}

fn check_size(found: [u32; 2], name: &str, expected: Option<[u32; 2]>) -> Result<()> {
    match expected.filter(|expected| *expected != found) {
        Some(expected) => Err(Error::OtherSize { name: name.to_owned(), expected, found }),
        None => Ok(()),
    }
}

fn refused(name: &str, source: PictureError) -> Error {
    Error::Demonstration { name: name.into(), source: source.into() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_browsers_do_not_read_is_sent_as_jpeg() {
        let folder = tempfile::tempdir().unwrap();
        let picture = RgbImage::from_pixel(8, 6, image::Rgb([200, 40, 40]));
        for (name, media_type, is_same) in
            [("a.png", "image/png", true), ("b.tiff", "image/jpeg", false), ("c.bmp", "image/jpeg", false)]
        {
            let path = folder.path().join(name);
            picture.save(&path).unwrap();
            let (bytes, found) = Picture::open(&path, PixelFrame::Upright).unwrap().for_browser().unwrap();
            assert_eq!((found, bytes == fs::read(&path).unwrap()), (media_type, is_same), "{name}");
            assert!(name.ends_with(extension_of(&fs::read(&path).unwrap())), "{name}");
            let found = image::guess_format(&bytes).unwrap().to_mime_type();
            assert_eq!(found, media_type, "{name}");
        }
        assert_eq!(pictures_in(folder.path()).unwrap().len(), 3);
    }
}
