//! Picture files.

use std::io::Cursor;

use image::{DynamicImage, ImageFormat, Rgb, RgbImage};
use sdg_picture::{ImageLimits, JpegScanner, PixelFrame, PpmHead, decode_image_in, is_turned_by_exif};

use super::bytes::file;
use super::jpegs::{of_zeros, of_zeros_with_restarts, without_tables};
use crate::target::Target;

/// A small limit, because a wrong size in a header must take neither much memory nor much time: with a million pixels a
/// million executions took hours. The program's own limit is 210 megapixels.
const LIMITS: ImageLimits = ImageLimits { max_pixels: 128 * 128 };
/// A decoder holds a picture twice, in 16 bits with alpha, and its own tables, and WebP's a chunk of up to 16 MiB. A JPEG
/// inside a TIFF may have sides that differ from the page's.
const MAX_EXTRA_BYTES: usize = 24 << 20;

/// A small picture of many colours.
pub(super) fn picture() -> RgbImage {
    RgbImage::from_fn(31, 17, |x, y| Rgb([(x * 8) as u8, (y * 13) as u8, (x * y) as u8]))
}

/// The picture as a file.
pub(super) fn encoded(format: ImageFormat) -> Vec<u8> {
    written(&picture().into(), format)
}

fn written(picture: &DynamicImage, format: ImageFormat) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    picture.write_to(&mut bytes, format).expect("a picture is encoded");
    bytes.into_inner()
}

/// The picture with an alpha channel, as a file.
fn with_alpha(format: ImageFormat) -> Vec<u8> {
    let mut picture = DynamicImage::ImageRgb8(picture()).into_rgba8();
    picture.pixels_mut().enumerate().for_each(|(place, pixel)| pixel.0[3] = if place % 3 == 0 { 0 } else { 255 });
    written(&picture.into(), format)
}

/// Pictures of the corpus, which corpus/make_pictures.py wrote.
fn of_corpus<const N: usize>(names: [&str; N]) -> [Vec<u8>; N] {
    names.map(|name| file(&format!("fuzz/corpus/pictures/{name}")))
}

/// Decodes a picture in one of the two frames, which the bytes determine, because decoding takes most of the time.
fn read(bytes: &[u8]) -> bool {
    let _ = is_turned_by_exif(bytes);
    let parity = bytes.iter().fold(0_u8, |all, byte| all ^ byte) % 2;
    let frame = if parity == 0 { PixelFrame::Sensor } else { PixelFrame::Upright };
    let Ok(picture) = decode_image_in(bytes, &LIMITS, frame) else { return false };
    let num_pixels = u64::from(picture.width()) * u64::from(picture.height());
    assert!((1..=LIMITS.max_pixels).contains(&num_pixels), "{} × {}", picture.width(), picture.height());
    true
}

/// PNG with different kinds of pixels: 1 to 16 bits, grey, with a palette, with alpha, interlaced.
pub(super) const PNG: Target = Target {
    name: "png",
    max_extra_bytes: MAX_EXTRA_BYTES,
    quick_executions: 10_000,
    dictionary: &[b"IHDR", b"PLTE", b"tRNS", b"IDAT", b"iCCP", b"eXIf", b"acTL", b"fcTL", b"IEND"],
    seeds: || {
        let colors = DynamicImage::ImageRgb8(picture());
        let deep = written(&colors.to_rgba16().into(), ImageFormat::Png);
        let grey = written(&colors.to_luma8().into(), ImageFormat::Png);
        let mut seeds = vec![encoded(ImageFormat::Png), deep, grey, with_alpha(ImageFormat::Png)];
        seeds.extend(of_corpus([
            "palette.png",
            "palette-alpha.png",
            "palette-interlaced.png",
            "interlaced.png",
            "bits.png",
            "grey-10.png",
            "grey-dark.png",
            "grey-alpha-12.png",
            "rgb-12.png",
            "rgb-key.png",
            "rgba-10.png",
            "alpha-unset.png",
        ]));
        seeds
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

/// JPEG with an orientation, in grey and in inks, progressive, with restart markers, without tables, with runs of zeros;
/// and the scanner that splits a stream of JPEGs.
pub(super) const JPEG: Target = Target {
    name: "jpeg",
    max_extra_bytes: MAX_EXTRA_BYTES,
    quick_executions: 10_000,
    dictionary: &[
        b"\xff\xd8\xff",
        b"\xff\xd9",
        b"\xff\xff",
        b"\xff\x01",
        b"\xff\xc2",
        b"\xff\xc4",
        b"\xff\xcc\x00\x04",
        b"\xff\xd1",
        b"\xff\xdb",
        b"\xff\xdd",
        b"\xff\xe1\x00\x22Exif\0\0MM\0*",
        b"\xff\xee",
    ],
    seeds: || {
        let plain = encoded(ImageFormat::Jpeg);
        let grey = written(&DynamicImage::ImageRgb8(picture()).to_luma8().into(), ImageFormat::Jpeg);
        // A fill byte, and orientation 6 in big-endian byte order.
        let exif = b"\xff\xff\xe1\x00\x22Exif\0\0MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0\x06\0\0\0\0\0\0";
        let turned = [&plain[..2], exif, &plain[2..]].concat();
        // Some cameras omit the end marker.
        let endless = plain[..plain.len() - 2].to_vec();
        let bare = without_tables(&plain);
        let mut seeds = vec![plain, grey, turned, endless, bare, of_zeros(), of_zeros_with_restarts()];
        seeds.extend(of_corpus([
            "progressive.jpg",
            "progressive-turned.jpg",
            "restarts.jpg",
            "subsampled.jpg",
            "inks.jpg",
        ]));
        seeds
    },
    run: |bytes| {
        let mut scanner = JpegScanner::default();
        for end in [bytes.len() / 3, bytes.len()] {
            let _ = scanner.advance(&bytes[..end]);
        }
        read(bytes)
    },
};

/// TIFF in both byte orders, with strips, tiles and planes, several pages, palettes, inks, floats, and each compression.
pub(super) const TIFF: Target = Target {
    name: "tiff",
    max_extra_bytes: MAX_EXTRA_BYTES,
    quick_executions: 20_000,
    dictionary: &[
        b"II*\0",
        b"MM\0*",
        b"II+\0\x08\0\0\0",
        b"\x12\x01\x03\0",
        b"\x53\x01\x03\0",
        b"\x0e\x01\x02\0",
        // Photometric interpretation: raw photos.
        b"\x06\x01\x03\0\x01\0\0\0\x23\x80",
        b"\x01\x06\0\x03\0\0\0\x01\x88\x4c",
    ],
    seeds: || {
        let deep = written(&DynamicImage::ImageRgb8(picture()).to_rgb16().into(), ImageFormat::Tiff);
        let mut seeds = vec![encoded(ImageFormat::Tiff), deep, with_alpha(ImageFormat::Tiff)];
        seeds.extend(of_corpus([
            "pages.tif",
            "old-thumbnail.tif",
            "subdirectory.tif",
            "palette.tif",
            "palette-big.tif",
            "strips-deflate.tif",
            "tiles-deflate.tif",
            "planar.tif",
            "inks.tif",
            "inks-16.tif",
            "grey-10.tif",
            "grey-white-is-zero.tif",
            "floats-10.tif",
            "floats-alpha.tif",
            "lzw.tif",
            "packbits.tif",
            "fax.tif",
            "jpeg.tif",
        ]));
        seeds
    },
    run: read,
};

/// WebP, BMP and PPM, and the first bytes of formats that are refused by name.
pub(super) const OTHERS: Target = Target {
    name: "webp_bmp_ppm",
    max_extra_bytes: MAX_EXTRA_BYTES,
    quick_executions: 20_000,
    dictionary: &[
        b"RIFF",
        b"WEBPVP8L",
        b"VP8X",
        b"ALPH",
        b"EXIF",
        b"BM",
        b"P6\n",
        b"# a\n",
        b"255\n",
        b"GIF89a",
        b"\0\0\0\x18ftypheic",
        b"\0\0\0\x18ftypavif",
        b"\0\0\0\x18ftypisom",
    ],
    seeds: || {
        let ppm = [b"P6\n# made here\n31 17\n255\n".as_slice(), picture().as_raw()].concat();
        // A comment that is longer than a header may be before its numbers are known.
        let remark = [b"P6 #".as_slice(), &[b'x'; 1500], b"\n2 1\n255\nabcdef"].concat();
        let mut seeds = vec![encoded(ImageFormat::WebP), encoded(ImageFormat::Bmp), ppm, remark];
        // Short files, so that mistakes often replace their first bytes.
        seeds.extend([b"P6 1 1 255\nabc".to_vec(), b"P6\t2\r1 255 abcdef".to_vec()]);
        seeds.extend(of_corpus([
            "lossy.webp",
            "lossy-alpha-turned.webp",
            "palette.webp",
            "animated.webp",
            "animated-alpha.webp",
            "palette.bmp",
            "palette-4.bmp",
            "runs-8.bmp",
            "runs-4.bmp",
            "masks-16.bmp",
            "rgb-32.bmp",
        ]));
        seeds
    },
    run: |bytes| {
        let _ = PpmHead::read(bytes);
        read(bytes)
    },
};
