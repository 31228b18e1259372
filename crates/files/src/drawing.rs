//! PNG files that are marked in their text as drawings of this program, so that a drawing may replace another
//! drawing but never a photo.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use image::RgbImage;
use png::{BitDepth, ColorType, Encoder};

use crate::error::{FileError, Result};
use crate::inputs;

const KEYWORD: &str = "Software";
const TEXT: &str = "sdg drawing";
/// Maximum position of the end of the text. The text precedes the pixels and follows 33 bytes of signature and size.
const MAX_TEXT_END: u64 = 100;

/// Writes a picture as PNG, atomically, never over an input or a file of another kind.
///
/// # Errors
/// [`FileError::Picture`], and the errors of [`crate::write`].
pub fn write_png(path: &Path, picture: &RgbImage) -> Result<()> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    let encoded = picture.write_to(&mut bytes, image::ImageFormat::Png);
    encoded.map_err(|source| FileError::Picture { path: path.to_owned(), source })?;
    inputs::write(path, &bytes.into_inner())
}

/// Writes a drawing atomically.
///
/// # Errors
/// The path is an input, or a file that is not a drawing of this program; or the system does not allow it.
pub fn write_drawing(path: &Path, drawing: &RgbImage) -> Result<()> {
    check_replaces_a_drawing(path)?;
    let bytes = encode(drawing).map_err(|source| FileError::Png { path: path.to_owned(), source })?;
    inputs::write(path, &bytes)
}

fn encode(drawing: &RgbImage) -> Result<Vec<u8>, png::EncodingError> {
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(&mut bytes, drawing.width(), drawing.height());
    encoder.set_color(ColorType::Rgb);
    encoder.set_depth(BitDepth::Eight);
    encoder.add_text_chunk(KEYWORD.to_owned(), TEXT.to_owned())?;
    let mut writer = encoder.write_header()?;
    writer.write_image_data(drawing)?;
    writer.finish()?;
    Ok(bytes)
}

/// Checks that a drawing replaces only an earlier drawing, an empty file or nothing.
///
/// # Errors
/// The path leads to another file.
fn check_replaces_a_drawing(path: &Path) -> Result<()> {
    let Ok(file) = File::open(path) else { return Ok(()) };
    let mut start = Vec::new();
    let is_read = file.take(MAX_TEXT_END).read_to_end(&mut start).is_ok();
    let text = [KEYWORD, "\0", TEXT].concat();
    let is_drawing = start.windows(text.len()).any(|window| window == text.as_bytes());
    if is_read && !start.is_empty() && !is_drawing {
        return Err(FileError::NoDrawing { path: path.to_owned() });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_drawing_replaces_a_drawing_and_no_photo() {
        let folder = tempfile::tempdir().unwrap();
        let [drawn, photo, empty] = ["drawn.png", "photo.png", "empty.png"].map(|name| folder.path().join(name));
        let picture = RgbImage::from_fn(40, 30, |x, y| image::Rgb([x as u8, y as u8, 7]));
        picture.save(&photo).unwrap();
        std::fs::write(&empty, "").unwrap();
        for path in [&drawn, &drawn, &empty] {
            write_drawing(path, &picture).unwrap();
            assert_eq!(image::open(path).unwrap().to_rgb8(), picture);
        }
        let before = std::fs::read(&photo).unwrap();
        let error = write_drawing(&photo, &picture).unwrap_err().to_string();
        assert!(error.contains("photo.png: expected a new name, or an earlier drawing"), "{error}");
        assert_eq!(std::fs::read(&photo).unwrap(), before);
    }
}
