//! Picture files.

use std::io::Cursor;

use image::{ImageFormat, Rgb, RgbImage};
use sdg_picture::{ImageLimits, JpegScanner, PixelFrame, PpmHead, decode_image_in, is_turned_by_exif};

use super::bytes::file;
use crate::target::Target;

/// A small limit, so that a header cannot request much memory: the program's own limit is
/// 210 megapixels.
const LIMITS: ImageLimits = ImageLimits { max_pixels: 1_000_000 };
/// A decoder holds a picture twice, in 16 bits with alpha.
const MAX_EXTRA_BYTES: usize = 64 << 20;

/// A small picture of many colours.
pub(super) fn picture() -> RgbImage {
    RgbImage::from_fn(31, 17, |x, y| Rgb([(x * 8) as u8, (y * 13) as u8, (x * y) as u8]))
}

/// The picture as a file.
pub(super) fn encoded(format: ImageFormat) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    picture().write_to(&mut bytes, format).expect("a picture is encoded");
    bytes.into_inner()
}

/// The picture with an alpha channel, as a file.
fn with_alpha(format: ImageFormat) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    let mut picture = image::DynamicImage::ImageRgb8(picture()).into_rgba8();
    picture.pixels_mut().enumerate().for_each(|(place, pixel)| pixel.0[3] = if place % 3 == 0 { 0 } else { 255 });
    picture.write_to(&mut bytes, format).expect("a picture is encoded");
    bytes.into_inner()
}

fn read(bytes: &[u8]) -> bool {
    let _ = is_turned_by_exif(bytes);
    let _ = decode_image_in(bytes, &LIMITS, PixelFrame::Sensor);
    decode_image_in(bytes, &LIMITS, PixelFrame::Upright).is_ok()
}

/// PNG with different kinds of pixels: 8 and 16 bits, grey, with alpha.
pub(super) const PNG: Target = Target {
    name: "png",
    max_extra_bytes: MAX_EXTRA_BYTES,
    quick_executions: 10_000,
    dictionary: &[b"IHDR", b"PLTE", b"tRNS", b"IDAT", b"iCCP", b"eXIf", b"acTL", b"fcTL", b"IEND"],
    seeds: || {
        let deep = image::DynamicImage::ImageRgb8(picture()).into_rgba16();
        let grey = image::DynamicImage::ImageRgb8(picture()).into_luma8();
        let mut bytes = [Cursor::new(Vec::new()), Cursor::new(Vec::new())];
        deep.write_to(&mut bytes[0], ImageFormat::Png).expect("a picture is encoded");
        grey.write_to(&mut bytes[1], ImageFormat::Png).expect("a picture is encoded");
        let [deep, grey] = bytes.map(Cursor::into_inner);
        vec![encoded(ImageFormat::Png), deep, grey, with_alpha(ImageFormat::Png)]
    },
    run: read,
};

/// PNG with corrected checksums, so that mistakes get past the checksum test.
pub(super) const PNG_CHUNKS: Target = Target {
    name: "png_chunks",
    seeds: || {
        let plain = encoded(ImageFormat::Png);
        // Orientation 6, between the header and the pixels.
        let exif = b"\0\0\0\x1aeXIfMM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0\x06\0\0\0\0\0\0\0\0\0\0";
        let turned = [&plain[..33], exif, &plain[33..]].concat();
        (PNG.seeds)().into_iter().chain([turned]).collect()
    },
    run: |bytes| read(&with_checksums(bytes)),
    ..PNG
};

/// A PNG with the correct checksum for each complete chunk.
fn with_checksums(bytes: &[u8]) -> Vec<u8> {
    let mut png = bytes.to_vec();
    let mut at = 8;
    while let Some(&[a, b, c, d]) = png.get(at..at + 4).and_then(|length| length.first_chunk::<4>()) {
        let end = (at + 8).saturating_add(u32::from_be_bytes([a, b, c, d]) as usize);
        let Some(checked) = png.get(at + 4..end) else { break };
        let sum = crc32fast::hash(checked).to_be_bytes();
        let Some(place) = png.get_mut(end..end + 4) else { break };
        place.copy_from_slice(&sum);
        at = end + 4;
    }
    png
}

/// JPEG with an orientation, and the scanner that splits a stream of JPEGs.
pub(super) const JPEG: Target = Target {
    name: "jpeg",
    max_extra_bytes: MAX_EXTRA_BYTES,
    quick_executions: 10_000,
    dictionary: &[
        b"\xff\xd8\xff",
        b"\xff\xd9",
        b"\xff\xc2",
        b"\xff\xc4",
        b"\xff\xdb",
        b"\xff\xdd",
        b"\xff\xe1\x00\x22Exif\0\0MM\0*",
        b"\xff\xee",
    ],
    seeds: || {
        let plain = encoded(ImageFormat::Jpeg);
        // Orientation 6 in big-endian byte order.
        let exif = b"\xff\xe1\x00\x22Exif\0\0MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0\x06\0\0\0\0\0\0";
        let turned = [&plain[..2], exif, &plain[2..]].concat();
        vec![plain, turned]
    },
    run: |bytes| {
        let mut scanner = JpegScanner::default();
        for end in [bytes.len() / 3, bytes.len()] {
            let _ = scanner.advance(&bytes[..end]);
        }
        read(bytes)
    },
};

/// TIFF.
pub(super) const TIFF: Target = Target {
    name: "tiff",
    max_extra_bytes: MAX_EXTRA_BYTES,
    quick_executions: 20_000,
    dictionary: &[b"II*\0", b"MM\0*", b"II+\0\x08\0\0\0", b"\x12\x01\x03\0", b"\x53\x01\x03\0", b"\x0e\x01\x02\0"],
    seeds: || {
        let deep = image::DynamicImage::ImageRgb8(picture()).into_rgb16();
        let mut bytes = Cursor::new(Vec::new());
        deep.write_to(&mut bytes, ImageFormat::Tiff).expect("a picture is encoded");
        vec![encoded(ImageFormat::Tiff), bytes.into_inner(), with_alpha(ImageFormat::Tiff)]
    },
    run: read,
};

/// WebP, BMP, PPM, and a JPEG photo.
pub(super) const OTHERS: Target = Target {
    name: "webp_bmp_ppm",
    max_extra_bytes: MAX_EXTRA_BYTES,
    quick_executions: 2_000,
    dictionary: &[b"RIFF", b"WEBPVP8L", b"VP8X", b"ALPH", b"EXIF", b"BM", b"P6\n", b"# a\n", b"255\n"],
    seeds: || {
        let ppm = [b"P6\n# made here\n31 17\n255\n".as_slice(), picture().as_raw()].concat();
        vec![
            encoded(ImageFormat::WebP),
            encoded(ImageFormat::Bmp),
            ppm,
            file("crates/demonstration/tests/outlines/generated-00.jpg"),
        ]
    },
    run: |bytes| {
        let _ = PpmHead::read(bytes);
        read(bytes)
    },
};
