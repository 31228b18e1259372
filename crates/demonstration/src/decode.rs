//! A photo from its bytes: PNG, JPEG and (feature `more-image-formats`) WebP, BMP and TIFF by content, checked before memory is
//! taken, upright.

use std::io::Cursor;

use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader, Limits, Rgb, RgbImage, metadata::Orientation};

use crate::{Error, Result};

/// What an image may at most be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ImageLimits {
    /// Width × height, by the file's header.
    pub max_pixels: u64,
}

impl Default for ImageLimits {
    /// 50 megapixels: every phone's standard mode, and 150 MB once decoded.
    fn default() -> Self {
        Self { max_pixels: 50_000_000 }
    }
}

/// How the names of picture files end, whose content [`decode_image`] may read.
pub const IMAGE_EXTENSIONS: [&str; 7] = ["png", "jpg", "jpeg", "webp", "bmp", "tif", "tiff"];

/// The formats and their names; those of which the decoder was not compiled are refused by name.
const FORMATS: [(ImageFormat, &str); 5] = [
    (ImageFormat::Png, "PNG"),
    (ImageFormat::Jpeg, "JPEG"),
    (ImageFormat::WebP, "WebP"),
    (ImageFormat::Bmp, "BMP"),
    (ImageFormat::Tiff, "TIFF"),
];

/// The formats that this build reads, as a message lists them.
fn readable_formats() -> String {
    let names: Vec<&str> =
        FORMATS.iter().filter(|(format, _)| format.reading_enabled()).map(|(_, name)| *name).collect();
    match names.split_last() {
        Some((last, others)) => format!("{} or {last}", others.join(", ")),
        None => String::new(),
    }
}

fn not_an_image(found: impl Into<String>) -> Error {
    Error::NotAnImage { expected: readable_formats(), found: found.into() }
}

/// Decodes a picture file into upright 8-bit RGB.
///
/// The content says what it is: PNG or JPEG, and with the feature `more-image-formats` WebP, BMP or TIFF. Grey and deeper
/// images are converted, transparent pixels laid over white, and the Exif orientation that phones write is applied, so that
/// the pixels stand as a viewer shows them. Of several pages or frames the first one counts.
///
/// # Errors
/// Bytes of another kind (for HEIC photos with the phone's setting that avoids them), a truncated or damaged file, zero width
/// or height, more than `limits.max_pixels`.
pub fn decode_image(bytes: &[u8], limits: &ImageLimits) -> Result<RgbImage> {
    if let Some(found) = iso_media(bytes) {
        return Err(not_an_image(found));
    }
    let guessed = image::guess_format(bytes).map_err(|_| not_an_image(describe(bytes)))?;
    let (format, name) = match FORMATS.iter().find(|(format, _)| *format == guessed) {
        Some(known) if guessed.reading_enabled() => *known,
        Some((_, name)) => return Err(not_an_image(*name)),
        None => return Err(not_an_image(format!("{guessed:?}"))),
    };
    let damaged = |error: image::ImageError| Error::DamagedImage { format: name, reason: error.to_string() };
    // Ahead of the decoder, which refuses an empty PNG with less to say.
    if let Some([width, height]) = png_header_size(bytes) {
        check_size(width, height, limits)?;
    }
    let mut decoder = ImageReader::with_format(Cursor::new(bytes), format).into_decoder().map_err(damaged)?;
    let (width, height) = decoder.dimensions();
    check_size(width, height, limits)?;
    if format == ImageFormat::Jpeg && !jpeg_is_complete(bytes) {
        // The decoder fills what is missing with grey and calls it a success.
        return Err(Error::DamagedImage {
            format: name,
            reason: "truncated, the end-of-image marker is missing".into(),
        });
    }

    let mut allocation = Limits::default();
    // 16-bit RGBA is the widest pixel that photos have.
    allocation.max_alloc = Some(limits.max_pixels.saturating_mul(8).saturating_add(1 << 20));
    decoder.set_limits(allocation).map_err(damaged)?;
    // A damaged Exif block is no reason to refuse the picture.
    let orientation = decoder.orientation().unwrap_or(Orientation::NoTransforms);
    let mut picture = DynamicImage::from_decoder(decoder).map_err(damaged)?;
    picture.apply_orientation(orientation);
    Ok(if picture.color().has_alpha() { over_white(&picture) } else { picture.into_rgb8() })
}

fn check_size(width: u32, height: u32, limits: &ImageLimits) -> Result<()> {
    if width == 0 || height == 0 {
        return Err(Error::EmptyImage { width, height });
    }
    if u64::from(width) * u64::from(height) > limits.max_pixels {
        return Err(Error::EnormousImage { width, height, max_pixels: limits.max_pixels });
    }
    Ok(())
}

/// What an ISO media file is, of which none is read: HEIC is under patents, and no small decoder in Rust reads AVIF.
fn iso_media(bytes: &[u8]) -> Option<&'static str> {
    let brand = bytes.get(8..12).filter(|_| bytes.get(4..8) == Some(b"ftyp"))?;
    match brand {
        b"heic" | b"heix" | b"heim" | b"heis" | b"hevc" | b"hevx" | b"mif1" | b"msf1" => Some(
            "a HEIC photo, as phones take them: on an iPhone set Settings > Camera > Formats > Most Compatible (on other \
             phones switch HEIF pictures off) and take it again, or export it as JPEG",
        ),
        b"avif" | b"avis" => Some("an AVIF picture: export it as JPEG or PNG"),
        _ => Some("a film or another ISO media file"),
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

/// Whether the end-of-image marker follows the first scan; thumbnails inside Exif blocks are stepped over.
fn jpeg_is_complete(bytes: &[u8]) -> bool {
    const START_OF_SCAN: u8 = 0xda;
    const END_OF_IMAGE: u8 = 0xd9;
    let mut at = 2;
    // Marker segments: 0xff, kind, two bytes of length that count themselves.
    while let Some(&[first, kind, high, low]) = bytes.get(at..at + 4) {
        if first != 0xff {
            return false;
        }
        if kind == 0xff {
            at += 1; // a fill byte
            continue;
        }
        at += 2 + usize::from(u16::from_be_bytes([high, low]));
        if kind == START_OF_SCAN {
            // Entropy-coded data writes a literal 0xff as 0xff00, so the pair cannot stand there by chance.
            return bytes.get(at..).is_some_and(|scan| scan.windows(2).any(|pair| pair == [0xff, END_OF_IMAGE]));
        }
    }
    false
}

fn over_white(picture: &DynamicImage) -> RgbImage {
    let rgba = picture.to_rgba8();
    RgbImage::from_fn(rgba.width(), rgba.height(), |x, y| {
        let [r, g, b, a] = rgba.get_pixel(x, y).0.map(u32::from);
        Rgb([r, g, b].map(|value| ((value * a + 255 * (255 - a) + 127) / 255) as u8))
    })
}

/// A word or two on bytes that are no image.
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
    use image::{GrayImage, ImageBuffer, Luma, Rgba, RgbaImage};
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

    /// A chunk of a PNG with a right checksum is not needed: the size is refused before the checksum is read.
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
        assert!(message("isom").contains("film"));
    }

    #[test]
    fn exif_orientation_is_applied() {
        // Exif, big endian, one entry: tag 0x0112 (orientation), short, 6 = turn by 90° clockwise to show.
        let tiff = b"MM\0\x2a\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0\x06\0\0\0\0\0\0";
        let mut jpeg = encode(&gradient(), ImageFormat::Jpeg);
        let mut segment = vec![0xff, 0xe1];
        segment.extend(((2 + 6 + tiff.len()) as u16).to_be_bytes());
        segment.extend(b"Exif\0\0");
        segment.extend(tiff);
        jpeg.splice(2..2, segment);
        let upright = decode(&jpeg).unwrap();
        assert_eq!(upright.dimensions(), (24, 40));
        // What was red-poor on the left is now red-poor at the top; green grows leftwards.
        assert!(upright.get_pixel(12, 2).0[0] < 60 && upright.get_pixel(12, 37).0[0] > 180);
        assert!(upright.get_pixel(2, 20).0[1] > upright.get_pixel(21, 20).0[1] + 100);
    }

    #[test]
    fn a_bomb_is_refused_by_its_header() {
        let found = decode(&png_header(60_000, 60_000)).unwrap_err();
        assert_eq!(found, Error::EnormousImage { width: 60_000, height: 60_000, max_pixels: 50_000_000 });
        assert!(found.to_string().contains("60000×60000 = 3600000000"), "{found}");
        let small = ImageLimits { max_pixels: 40 * 24 - 1 };
        assert!(decode_image(&encode(&gradient(), ImageFormat::Jpeg), &small).is_err());
    }

    #[test]
    fn an_empty_image_is_named() {
        assert_eq!(decode(&png_header(0, 7)), Err(Error::EmptyImage { width: 0, height: 7 }));
    }

    #[test]
    fn truncation_is_found_at_any_place() {
        for (format, _) in FORMATS {
            let bytes = encode(&gradient(), format);
            for keep in [bytes.len() / 4, bytes.len() / 2, bytes.len() * 9 / 10] {
                let found = decode(&bytes[..keep]);
                assert!(matches!(found, Err(Error::DamagedImage { .. })), "{format:?}, {keep} bytes: {found:?}");
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
