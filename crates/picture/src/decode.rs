//! Formats, limits and orientation of decoded pictures.

use std::borrow::Cow;
use std::io::Cursor;

use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader, Limits, RgbImage, metadata::Orientation};

use crate::error::PictureError;
use crate::{jpeg, jpeg_gap, ppm, samples, tiff, webp};

type Result<T> = std::result::Result<T, PictureError>;

/// Limits of an image.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ImageLimits {
    /// Maximum width × height, checked in the file's header.
    pub max_pixels: u64,
}

impl Default for ImageLimits {
    /// 210 megapixels (630 MB decoded): phones take photos of 50, 64, 108 and 200 megapixels.
    fn default() -> Self {
        Self { max_pixels: 210_000_000 }
    }
}

impl ImageLimits {
    /// Maximum number of bytes of the decoded pixels: 8 per pixel, as for 16-bit RGBA.
    fn max_bytes(&self) -> u64 {
        self.max_pixels.saturating_mul(8).saturating_add(1 << 20)
    }
}

/// Orientation of the decoded pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum PixelFrame {
    /// As shown by a viewer: rotated or mirrored by the Exif orientation.
    #[default]
    Upright,
    /// As delivered by the sensor, without the Exif orientation. A calibration refers to these pixels; phones that look
    /// straight down set an arbitrary orientation.
    Sensor,
}

/// File name extensions of pictures that [`decode_image`] may be able to read.
pub const IMAGE_EXTENSIONS: [&str; 7] = ["png", "jpg", "jpeg", "webp", "bmp", "tif", "tiff"];

/// The formats and their names; formats whose decoder is not compiled in are rejected by name.
const FORMATS: [(ImageFormat, &str); 5] = [
    (ImageFormat::Png, "PNG"),
    (ImageFormat::Jpeg, "JPEG"),
    (ImageFormat::WebP, "WebP"),
    (ImageFormat::Bmp, "BMP"),
    (ImageFormat::Tiff, "TIFF"),
];

/// Names of the formats in this build, for messages.
fn readable_formats() -> String {
    let names: Vec<&str> =
        FORMATS.iter().filter(|(format, _)| format.reading_enabled()).map(|(_, name)| *name).collect();
    match names.split_last() {
        Some((last, others)) => format!("{} or {last}", others.join(", ")),
        None => String::new(),
    }
}

fn not_an_image(found: impl Into<String>) -> PictureError {
    PictureError::NotAnImage { expected: readable_formats(), found: found.into() }
}

/// Decodes a picture to upright 8-bit RGB, like [`decode_image_in`].
///
/// # Errors
/// The errors of [`decode_image_in`].
pub fn decode_image(bytes: &[u8], limits: &ImageLimits) -> Result<RgbImage> {
    decode_image_in(bytes, limits, PixelFrame::Upright)
}

/// Decodes a picture to 8-bit RGB.
///
/// The format is recognised by the content: PNG, JPEG or PPM, and with the feature `more-formats` WebP, BMP or TIFF.
/// Grey and deeper images are converted; 10 and 12 bits stored in 16 are scaled by their own range. Transparent pixels
/// are composited over white, unless all pixels are (almost) fully transparent, which is how programs leave an unused
/// alpha channel. If a float is above 2, all are read as integers of 8 to 16 bits. Of a TIFF, the full-size page is
/// read.
///
/// # Errors
/// Another format (for a HEIC photo, the error names the phone's setting that avoids HEIC), a truncated or damaged
/// file, zero width or height, more than `limits.max_pixels` (PPM: also more than 67 megapixels, a side above 16384
/// pixels or a maximum value other than 255), a TIFF with several full-size pages, with raw data or with a palette that
/// does not have 8 bits, or a CMYK JPEG for which it is unknown whether the inks are inverted.
pub fn decode_image_in(bytes: &[u8], limits: &ImageLimits, frame: PixelFrame) -> Result<RgbImage> {
    if bytes.starts_with(b"P6") {
        return ppm::decode_ppm(bytes, |width, height| check_size(width, height, limits));
    }
    let (format, name) = format_of(bytes)?;
    let damaged = |error: image::ImageError| match &error {
        image::ImageError::Unsupported(_) => PictureError::UnsupportedKind {
            format: name,
            found: error.to_string(),
            remedy: "export it as PNG or JPEG, with 8 bits per channel",
        },
        _ => PictureError::DamagedImage { format: name, reason: error.to_string() },
    };
    // Checked before the decoder, whose error for an empty PNG is less specific.
    if let Some([width, height]) = png_header_size(bytes) {
        check_size(width, height, limits)?;
    }
    let mut palette = None;
    let bytes = match format {
        ImageFormat::Jpeg => {
            // The size is checked first, because the checks of the data decode the picture.
            let header = ImageReader::with_format(Cursor::new(bytes), format).into_dimensions();
            if let Ok((width, height)) = header {
                check_size(width, height, limits)?;
            }
            let jpeg = jpeg::complete_jpeg(bytes, limits.max_bytes())?;
            jpeg_gap::check_has_no_gap(&jpeg, limits.max_bytes())?;
            jpeg
        }
        ImageFormat::Tiff => {
            let page = tiff::full_page(bytes)?;
            palette = page.palette;
            page.bytes
        }
        ImageFormat::WebP => {
            webp::check_chunks(bytes)?;
            Cow::Borrowed(bytes)
        }
        _ => Cow::Borrowed(bytes),
    };
    let mut decoder = ImageReader::with_format(Cursor::new(&*bytes), format).into_decoder().map_err(damaged)?;
    let (width, height) = decoder.dimensions();
    check_size(width, height, limits)?;
    let mut allocation = Limits::default();
    allocation.max_alloc = Some(limits.max_bytes());
    decoder.set_limits(allocation).map_err(damaged)?;
    // A damaged Exif block is ignored.
    let orientation = decoder.orientation().unwrap_or(Orientation::NoTransforms);
    let picture = DynamicImage::from_decoder(decoder).map_err(damaged)?;
    let mut picture = match palette {
        Some(palette) => palette.applied(&picture).into(),
        None => picture,
    };
    if frame == PixelFrame::Upright {
        picture.apply_orientation(orientation);
    }
    Ok(samples::to_rgb8(picture))
}

/// Whether the picture has an Exif orientation that rotates or mirrors it; false for bytes that are not a picture.
pub fn is_turned_by_exif(bytes: &[u8]) -> bool {
    let Ok((format, _)) = format_of(bytes) else { return false };
    let bytes = match format {
        // `decode_image` reads this page, which need not be the first one.
        ImageFormat::Tiff => match tiff::full_page(bytes) {
            Ok(page) => page.bytes,
            Err(_) => return false,
        },
        ImageFormat::WebP if webp::check_chunks(bytes).is_err() => return false,
        _ => Cow::Borrowed(bytes),
    };
    let decoder = ImageReader::with_format(Cursor::new(&*bytes), format).into_decoder().ok();
    let orientation = decoder.and_then(|mut decoder| decoder.orientation().ok());
    orientation.is_some_and(|orientation| orientation != Orientation::NoTransforms)
}

/// The format recognised by the content, with its name.
fn format_of(bytes: &[u8]) -> Result<(ImageFormat, &'static str)> {
    if let Some(found) = iso_media(bytes) {
        return Err(not_an_image(found));
    }
    let guessed = match image::guess_format(bytes) {
        Ok(format) => format,
        Err(_) if tiff::is_big_tiff(bytes) => ImageFormat::Tiff,
        Err(_) => return Err(not_an_image(describe(bytes))),
    };
    match FORMATS.iter().find(|(format, _)| *format == guessed) {
        Some(known) if guessed.reading_enabled() => Ok(*known),
        Some((_, name)) => Err(not_an_image(*name)),
        None => Err(not_an_image(format!("{guessed:?}"))),
    }
}

fn check_size(width: u32, height: u32, limits: &ImageLimits) -> Result<()> {
    if width == 0 || height == 0 {
        return Err(PictureError::EmptyImage { width, height });
    }
    if u64::from(width) * u64::from(height) > limits.max_pixels {
        return Err(PictureError::EnormousImage { width, height, max_pixels: limits.max_pixels });
    }
    Ok(())
}

/// The kind of an ISO media file. No kind is supported: HEIC is patented, and there is no small AVIF decoder in Rust.
fn iso_media(bytes: &[u8]) -> Option<&'static str> {
    let brand = bytes.get(8..12).filter(|_| bytes.get(4..8) == Some(b"ftyp"))?;
    match brand {
        b"heic" | b"heix" | b"heim" | b"heis" | b"hevc" | b"hevx" | b"mif1" | b"msf1" => Some(
            "a HEIC photo, as phones take them: on an iPhone set Settings > Camera > Formats > Most Compatible (on other \
             phones switch HEIF pictures off) and take it again, or export it as JPEG",
        ),
        b"avif" | b"avis" => Some("an AVIF picture: export it as JPEG or PNG"),
        _ => Some("a video or another ISO media file"),
    }
}

/// Width and height from the IHDR chunk, which the standard puts first.
fn png_header_size(bytes: &[u8]) -> Option<[u32; 2]> {
    if !bytes.starts_with(b"\x89PNG\r\n\x1a\n") || bytes.get(12..16)? != b"IHDR" {
        return None;
    }
    let number = |at: usize| Some(u32::from_be_bytes(bytes.get(at..at + 4)?.try_into().ok()?));
    Some([number(16)?, number(20)?])
}

/// A short description of bytes that are not an image.
fn describe(bytes: &[u8]) -> String {
    if bytes.is_empty() {
        return "an empty file".into();
    }
    let head = &bytes[..bytes.len().min(16)];
    match std::str::from_utf8(head) {
        Ok(text) if text.chars().all(|c| !c.is_control() || c.is_whitespace()) => {
            format!("text starting with `{}`", text.escape_debug())
        }
        _ => format!("bytes starting with {head:02x?}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::{GrayImage, ImageBuffer, Luma, Rgb, Rgba, RgbaImage};
    use proptest::prelude::*;

    fn encode(picture: &DynamicImage, format: ImageFormat) -> Vec<u8> {
        let mut bytes = Cursor::new(Vec::new());
        picture.write_to(&mut bytes, format).unwrap();
        bytes.into_inner()
    }

    fn gradient() -> DynamicImage {
        RgbImage::from_fn(40, 24, |x, y| Rgb([x as u8 * 6, y as u8 * 10, 90])).into()
    }

    fn decode(bytes: &[u8]) -> Result<RgbImage> {
        decode_image(bytes, &ImageLimits::default())
    }

    /// A PNG with another size in its header. The checksum is then wrong, but the size is rejected first.
    fn png_header(width: u32, height: u32) -> Vec<u8> {
        let mut bytes = encode(&gradient(), ImageFormat::Png);
        bytes[16..20].copy_from_slice(&width.to_be_bytes());
        bytes[20..24].copy_from_slice(&height.to_be_bytes());
        bytes
    }

    #[test]
    fn png_is_exact_and_jpeg_close() {
        let picture = gradient();
        assert_eq!(decode(&encode(&picture, ImageFormat::Png)).unwrap(), picture.to_rgb8());
        let jpeg = decode(&encode(&picture, ImageFormat::Jpeg)).unwrap();
        assert_eq!(jpeg.dimensions(), (40, 24));
        assert!(jpeg.get_pixel(20, 12).0[0].abs_diff(120) < 12);
    }

    #[test]
    fn a_picture_of_few_pixels_with_many_bytes_each_is_refused() {
        let deep: ImageBuffer<Rgba<f32>, _> = ImageBuffer::from_pixel(512, 512, Rgba([0.5; 4]));
        let bytes = encode(&deep.into(), ImageFormat::Tiff);
        assert_eq!(decode(&bytes).unwrap().dimensions(), (512, 512));
        // The picture needs 16 bytes per pixel; 8 bytes per pixel and 1 MiB in addition are allowed.
        let error = decode_image(&bytes, &ImageLimits { max_pixels: 512 * 512 }).unwrap_err().to_string();
        assert!(error.contains("Memory limit"), "{error}");
    }

    #[test]
    fn grey_deep_and_transparent_pixels_become_rgb() {
        let grey = GrayImage::from_pixel(3, 2, Luma([77]));
        assert_eq!(decode(&encode(&grey.into(), ImageFormat::Png)).unwrap().get_pixel(1, 1).0, [77; 3]);
        let deep: ImageBuffer<Rgb<u16>, _> = ImageBuffer::from_pixel(3, 2, Rgb([257 * 10, 257 * 20, 257 * 30]));
        assert_eq!(decode(&encode(&deep.into(), ImageFormat::Png)).unwrap().get_pixel(1, 1).0, [10, 20, 30]);
        // A quarter opaque black over white: 255 · (1 - 64/255) = 191.
        let clear = RgbaImage::from_pixel(3, 2, Rgba([0, 0, 0, 64]));
        assert_eq!(decode(&encode(&clear.into(), ImageFormat::Png)).unwrap().get_pixel(1, 1).0, [191; 3]);
    }

    #[test]
    fn webp_bmp_and_tiff_are_exact() {
        for format in [ImageFormat::WebP, ImageFormat::Bmp, ImageFormat::Tiff] {
            assert_eq!(decode(&encode(&gradient(), format)).unwrap(), gradient().to_rgb8(), "{format:?}");
        }
        let deep: ImageBuffer<Rgb<u16>, _> = ImageBuffer::from_pixel(3, 2, Rgb([257 * 10, 257 * 20, 257 * 30]));
        assert_eq!(decode(&encode(&deep.into(), ImageFormat::Tiff)).unwrap().get_pixel(1, 1).0, [10, 20, 30]);
        let clear = RgbaImage::from_pixel(3, 2, Rgba([0, 0, 0, 64]));
        assert_eq!(decode(&encode(&clear.into(), ImageFormat::WebP)).unwrap().get_pixel(1, 1).0, [191; 3]);
    }

    #[test]
    fn phones_photos_that_are_not_read_name_the_setting() {
        let message =
            |brand: &str| decode(format!("\0\0\0\x18ftyp{brand}\0\0\0\0").as_bytes()).unwrap_err().to_string();
        for brand in ["heic", "heix", "mif1"] {
            let message = message(brand);
            assert!(message.contains("Settings > Camera > Formats > Most Compatible"), "{message}");
            assert!(message.contains("expected a PNG, JPEG, WebP, BMP or TIFF file"), "{message}");
        }
        assert!(message("avif").contains("AVIF"));
        assert!(message("isom").contains("video"));
    }

    #[test]
    fn every_picture_of_the_maximum_size_fits_into_the_memory_of_the_checks() {
        let limits = ImageLimits::default();
        assert!(limits.max_bytes() >= 3 * limits.max_pixels);
    }

    #[test]
    fn exif_orientation_is_applied() {
        // Exif, big endian, one entry: tag 0x0112 (orientation), short, 6 = rotate by 90° clockwise for viewing.
        let tiff = b"MM\0\x2a\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0\x06\0\0\0\0\0\0";
        let mut jpeg = encode(&gradient(), ImageFormat::Jpeg);
        let mut segment = vec![0xff, 0xe1];
        segment.extend(((2 + 6 + tiff.len()) as u16).to_be_bytes());
        segment.extend(b"Exif\0\0");
        segment.extend(tiff);
        jpeg.splice(2..2, segment);
        let upright = decode(&jpeg).unwrap();
        assert_eq!(upright.dimensions(), (24, 40));
        // The side with little red was at the left and is now at the top; green increases to the left.
        assert!(upright.get_pixel(12, 2).0[0] < 60 && upright.get_pixel(12, 37).0[0] > 180);
        assert!(upright.get_pixel(2, 20).0[1] > upright.get_pixel(21, 20).0[1] + 100);
    }

    #[test]
    fn a_bomb_is_refused_by_its_header() {
        let found = decode(&png_header(60_000, 60_000)).unwrap_err();
        assert_eq!(found, PictureError::EnormousImage { width: 60_000, height: 60_000, max_pixels: 210_000_000 });
        assert!(found.to_string().contains("60000×60000 = 3600 megapixels"), "{found}");
        let ppm = [b"P6 40 24 255\n".as_slice(), gradient().to_rgb8().as_raw()].concat();
        let files = FORMATS.iter().map(|(format, _)| encode(&gradient(), *format)).chain([ppm]);
        let limits = [40 * 24, 40 * 24 - 1].map(|max_pixels| ImageLimits { max_pixels });
        for (idx, file) in files.enumerate() {
            let [whole, refused] = limits.map(|limits| decode_image(&file, &limits));
            assert!(whole.is_ok(), "file {idx}");
            let enormous = PictureError::EnormousImage { width: 40, height: 24, max_pixels: 40 * 24 - 1 };
            assert_eq!(refused, Err(enormous), "file {idx}");
        }
        // A JPEG without its end marker: the check of its data would decode the picture, so its size is checked first.
        let mut jpeg = encode(&gradient(), ImageFormat::Jpeg);
        jpeg.truncate(jpeg.len() - 2);
        let frame = jpeg.windows(2).position(|marker| marker == [0xff, 0xc0]).unwrap();
        jpeg[frame + 5..frame + 9].copy_from_slice(&[0xea, 0x60, 0xea, 0x60]);
        assert!(matches!(decode(&jpeg), Err(PictureError::EnormousImage { width: 60_000, height: 60_000, .. })));
    }

    #[test]
    fn an_empty_image_is_named() {
        assert_eq!(decode(&png_header(0, 7)), Err(PictureError::EmptyImage { width: 0, height: 7 }));
    }

    #[test]
    fn truncation_is_found_at_any_place() {
        for (format, _) in FORMATS {
            let bytes = encode(&gradient(), format);
            for keep in [bytes.len() / 4, bytes.len() / 2, bytes.len() * 9 / 10] {
                let found = decode(&bytes[..keep]);
                assert!(matches!(found, Err(PictureError::DamagedImage { .. })), "{format:?}, {keep} bytes: {found:?}");
            }
        }
    }

    #[test]
    fn other_files_are_described() {
        let message = |bytes: &[u8]| decode(bytes).unwrap_err().to_string();
        assert!(message(b"").contains("an empty file"));
        assert!(message(b"{\"shapes\": []}").contains("text starting with"));
        assert!(message(b"GIF89a\0\0\0\0").contains("Gif"));
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(300))]
        #[test]
        fn arbitrary_bytes_never_panic(bytes in prop::collection::vec(any::<u8>(), 0..200), start in 0usize..7) {
            let starts: [&[u8]; 7] =
                [b"", b"\x89PNG\r\n\x1a\n", b"\xff\xd8\xff\xe0", b"RIFF\x40\0\0\0WEBPVP8 ", b"BM", b"II\x2a\0", b"\0\0\0\x18ftyp"];
            let mut file = starts[start].to_vec();
            file.extend(bytes);
            let _ = decode(&file);
        }

        #[test]
        fn a_damaged_byte_never_panics(at in 0.0..1.0f64, value in any::<u8>(), format in 0..FORMATS.len()) {
            let mut file = encode(&gradient(), FORMATS[format].0);
            let at = (at * file.len() as f64) as usize;
            file[at] = value;
            let _ = decode(&file);
        }
    }
}
