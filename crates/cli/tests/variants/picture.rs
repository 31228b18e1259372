//! Ways to store a picture: lossless, lossy, damaged.

use std::io::Cursor;

use image::codecs::jpeg::JpegEncoder;
use image::{DynamicImage, ImageFormat, RgbImage, RgbaImage};
use rand::Rng;
use rand_pcg::Pcg64Mcg;

use super::png::Png;
use super::scene::{Scene, color_of, numbers_of};
use super::tiff::{Compression, Tiff};
use crate::picture_kinds::{encoded, stored_for, with_orientation};

/// A picture in a file.
#[derive(Debug, Clone)]
pub struct Photo {
    pub name: String,
    pub bytes: Vec<u8>,
    /// Description of the storage.
    pub recipe: String,
}

/// File names without extension, as people and systems choose them.
const STEMS: [&str; 12] = [
    "photo",
    "Schlüssel groß",
    "Schlu\u{308}ssel",
    "IMG_0001 (2)",
    "PHOTO",
    "Teil-é#1",
    "100%25",
    "a.b.c",
    "部品",
    "it's",
    "x+y=z",
    " lead",
];

pub fn pick<'a, T>(dice: &mut Pcg64Mcg, of: &'a [T]) -> &'a T {
    &of[dice.random_range(0..of.len())]
}

fn named(dice: &mut Pcg64Mcg, endings: &[&str], recipe: String, bytes: Vec<u8>) -> Photo {
    let wrong_ending = dice.random_bool(0.15);
    let ending = if wrong_ending { pick(dice, &["jpg", "png", "bmp", "tiff"]) } else { pick(dice, endings) };
    let stem = pick(dice, &STEMS);
    let name = format!("{stem}.{ending}");
    Photo { recipe: format!("{name:?}, {recipe}"), name, bytes }
}

/// The picture in a file, stored without loss.
pub fn lossless(dice: &mut Pcg64Mcg, photo: &RgbImage) -> Photo {
    match dice.random_range(0..10) {
        0..=3 => png(dice, photo),
        4..=6 => tiff(dice, photo),
        7 => bmp(dice, photo),
        8 => webp(dice, photo),
        _ => ppm(dice, photo),
    }
}

fn orientation(dice: &mut Pcg64Mcg) -> Option<u8> {
    dice.random_bool(0.5).then(|| dice.random_range(1..=8))
}

/// Samples with the given number of channels and bytes per sample, big endian.
fn samples(photo: &RgbImage, num_channels: usize, bytes_per_sample: usize, alpha: u8) -> Vec<u8> {
    let channels = |pixel: &image::Rgb<u8>| {
        let [r, g, b] = pixel.0;
        [r, g, b, alpha]
            .into_iter()
            .take(num_channels)
            .flat_map(|value| vec![value; bytes_per_sample])
            .collect::<Vec<_>>()
    };
    photo.pixels().flat_map(channels).collect()
}

fn png(dice: &mut Pcg64Mcg, photo: &RgbImage) -> Photo {
    let orientation = orientation(dice);
    let stored = stored_for(photo, orientation.unwrap_or(1)).to_rgb8();
    let (num_channels, bit_depth) = *pick(dice, &[(1, 8), (3, 8), (4, 8), (3, 16), (4, 16)]);
    let bytes_per_sample = usize::from(bit_depth) / 8;
    // An alpha channel that is 0 or 1 everywhere counts as never set.
    let alpha = if bit_depth == 8 { *pick(dice, &[255, 0, 1]) } else { 255 };
    let is_palette = num_channels == 1;
    let file = Png {
        size: stored.dimensions().into(),
        samples: match is_palette {
            true => numbers_of(&stored),
            false => samples(&stored, num_channels, bytes_per_sample, alpha),
        },
        bytes_per_pixel: num_channels * bytes_per_sample,
        bit_depth,
        color_type: [3, 0, 2, 6][num_channels - 1],
        palette: if is_palette { (0..=255).flat_map(|number| color_of(number).0).collect() } else { Vec::new() },
        filter: dice.random_range(0..=5),
        is_interlaced: dice.random_bool(0.3),
        num_pieces: dice.random_range(1..5),
        orientation,
    };
    let recipe = format!(
        "PNG of {num_channels}×{bit_depth} bits, alpha {alpha}, filter {}, interlaced {}, {} pieces, Exif {orientation:?}",
        file.filter, file.is_interlaced, file.num_pieces
    );
    named(dice, &["png", "PNG"], recipe, file.bytes())
}

/// A plain TIFF of 8-bit RGB, the basis of the other TIFFs.
fn plain_tiff(photo: &RgbImage) -> Tiff {
    Tiff {
        size: photo.dimensions().into(),
        samples: photo.as_raw().clone(),
        num_channels: 3,
        bytes_per_sample: 1,
        is_big_endian: false,
        is_big_tiff: false,
        compression: Compression::None,
        rows_per_strip: photo.height() as usize,
        is_planar: false,
        palette: None,
        is_float: false,
        orientation: None,
        thumbnails: 0,
        other_pages: 0,
    }
}

fn tiff(dice: &mut Pcg64Mcg, photo: &RgbImage) -> Photo {
    use Compression::{Deflate, Lzw, None, PackBits};
    let orientation = orientation(dice);
    let stored = stored_for(photo, orientation.unwrap_or(1)).to_rgb8();
    let kind = *pick(dice, &["RGB", "palette", "RGBA", "RGB of 16 bits", "floats to 1", "floats to 255"]);
    let is_big_endian = dice.random_bool(0.5);
    let float = |value: u8| {
        let value = f32::from(value) / if kind == "floats to 1" { 255.0 } else { 1.0 };
        if is_big_endian { value.to_be_bytes() } else { value.to_le_bytes() }
    };
    let palette = || [0, 1, 2].iter().flat_map(|c| (0..=255).map(|n| u16::from(color_of(n).0[*c]) * 257)).collect();
    let (samples, num_channels, bytes_per_sample) = match kind {
        "palette" => (numbers_of(&stored), 1, 1),
        "RGBA" => (samples(&stored, 4, 1, 255), 4, 1),
        "RGB of 16 bits" => (samples(&stored, 3, 2, 255), 3, 2),
        "RGB" => (stored.as_raw().clone(), 3, 1),
        _ => (stored.as_raw().iter().flat_map(|value| float(*value)).collect(), 3, 4),
    };
    let file = Tiff {
        size: stored.dimensions().into(),
        samples,
        num_channels,
        bytes_per_sample,
        is_big_endian,
        is_big_tiff: dice.random_bool(0.3),
        compression: *pick(dice, &[None, Lzw, Deflate, PackBits]),
        rows_per_strip: *pick(dice, &[7, 16, 64, 1000]),
        is_planar: num_channels > 1 && dice.random_bool(0.3),
        palette: (kind == "palette").then(palette),
        is_float: kind.starts_with("floats"),
        orientation,
        thumbnails: usize::from(dice.random_bool(0.3)),
        ..plain_tiff(&stored)
    };
    let recipe = format!(
        "TIFF, {kind}, {:?}, big endian {is_big_endian}, BigTIFF {}, strips of {} rows, planes {}, Exif {orientation:?}, {} thumbnails",
        file.compression, file.is_big_tiff, file.rows_per_strip, file.is_planar, file.thumbnails
    );
    named(dice, &["tif", "tiff", "TIF"], recipe, file.bytes())
}

fn with_alpha(photo: &RgbImage, alpha: u8) -> RgbaImage {
    let pixel = |pixel: &image::Rgb<u8>| [pixel[0], pixel[1], pixel[2], alpha];
    RgbaImage::from_raw(photo.width(), photo.height(), photo.pixels().flat_map(pixel).collect()).unwrap()
}

fn bmp(dice: &mut Pcg64Mcg, photo: &RgbImage) -> Photo {
    let kind = *pick(dice, &["24 bits", "24 bits from the top", "32 bits", "32 bits, alpha 0"]);
    let mut bytes = match kind {
        "24 bits" => encoded(&photo.clone().into(), ImageFormat::Bmp),
        // The rows are stored from the top; the height in the header is negative (below).
        "24 bits from the top" => encoded(&DynamicImage::from(photo.clone()).flipv(), ImageFormat::Bmp),
        "32 bits" => encoded(&with_alpha(photo, 255).into(), ImageFormat::Bmp),
        _ => encoded(&with_alpha(photo, 0).into(), ImageFormat::Bmp),
    };
    if kind == "24 bits from the top" {
        bytes[22..26].copy_from_slice(&(-(photo.height() as i32)).to_le_bytes());
    }
    named(dice, &["bmp", "BMP"], format!("BMP of {kind}"), bytes)
}

fn webp(dice: &mut Pcg64Mcg, photo: &RgbImage) -> Photo {
    let alpha = *pick(dice, &[None, Some(255), Some(0)]);
    let bytes = match alpha {
        Some(alpha) => encoded(&with_alpha(photo, alpha).into(), ImageFormat::WebP),
        None => encoded(&photo.clone().into(), ImageFormat::WebP),
    };
    named(dice, &["webp"], format!("lossless WebP, alpha {alpha:?}"), bytes)
}

fn ppm(dice: &mut Pcg64Mcg, photo: &RgbImage) -> Photo {
    let head = *pick(dice, &["P6\n320 240\n255\n", "P6 # a comment\n# another\n320\t240 255 "]);
    named(dice, &["ppm", "PPM"], format!("PPM {head:?}"), [head.as_bytes(), photo.as_raw()].concat())
}

/// The picture with changed pixels, damaged, or not a picture; and the words of which a refusal must contain one.
pub fn spoilt(dice: &mut Pcg64Mcg, photo: &RgbImage) -> (Photo, &'static [&'static str]) {
    let whole = DynamicImage::from(photo.clone());
    let jpeg = |quality: u8| {
        let mut bytes = Cursor::new(Vec::new());
        photo.write_with_encoder(JpegEncoder::new_with_quality(&mut bytes, quality)).unwrap();
        bytes.into_inner()
    };
    let cut = |bytes: &[u8], share: f64| bytes[..(bytes.len() as f64 * share) as usize].to_vec();
    let share = dice.random_range(0.05..0.98);
    let (recipe, bytes, named_fields): (String, Vec<u8>, &[&str]) = match dice.random_range(0..16) {
        0 | 1 => {
            let quality = *pick(dice, &[95, 85, 75, 60, 40]);
            (format!("JPEG of quality {quality}"), jpeg(quality), &["score"])
        }
        2 => {
            let orientation = dice.random_range(1..=8);
            let bytes = with_orientation(&stored_for(photo, orientation), orientation);
            (format!("JPEG with Exif {orientation}"), bytes, &["score"])
        }
        3 => {
            let mut bytes = jpeg(90);
            bytes.truncate(bytes.len() - 2);
            ("JPEG without its end marker".into(), bytes, &["end marker"])
        }
        4 => {
            let mut bytes = jpeg(90);
            let (start, end) = (bytes.len() * 2 / 5, bytes.len() * 3 / 5);
            bytes[start..end].fill(0);
            ("JPEG with zeros in its middle".into(), bytes, &["zeros"])
        }
        5 => {
            let mut bytes = jpeg(90);
            let frame = bytes.windows(2).position(|pair| pair == [0xff, 0xc0]).unwrap();
            bytes[frame + 9] = 4;
            ("JPEG of four inks without Adobe's marker".into(), bytes, &["CMYK"])
        }
        6 => (format!("JPEG cut at {share:.2}"), cut(&jpeg(90), share), &["JPEG", "bytes"]),
        7 => (format!("PNG cut at {share:.2}"), cut(&encoded(&whole, ImageFormat::Png), share), &["PNG"]),
        8 => (format!("TIFF cut at {share:.2}"), cut(&encoded(&whole, ImageFormat::Tiff), share), &["TIFF"]),
        9 => (format!("BMP cut at {share:.2}"), cut(&encoded(&whole, ImageFormat::Bmp), share), &["BMP"]),
        10 => (format!("WebP cut at {share:.2}"), cut(&encoded(&whole, ImageFormat::WebP), share), &["WebP"]),
        11 => {
            let tiff = Tiff { other_pages: 1, ..plain_tiff(photo) };
            ("TIFF of two pages".into(), tiff.bytes(), &["2 full-size pages"])
        }
        12 => ("PNG in grey".into(), encoded(&whole.to_luma8().into(), ImageFormat::Png), &["score"]),
        13 => {
            let gray = whole.to_luma8();
            let samples: Vec<u16> = gray.as_raw().iter().map(|value| u16::from(*value) * 16).collect();
            let deep =
                image::ImageBuffer::<image::Luma<u16>, _>::from_raw(photo.width(), photo.height(), samples).unwrap();
            ("PNG in grey of 12 bits in 16".into(), encoded(&deep.into(), ImageFormat::Png), &["score"])
        }
        14 => {
            let kinds: [&[u8]; 5] = [b"", b"GIF89a\x08\0\x06\0", b"\0\0\0\x18ftypheic\0\0\0\0", b"a letter", b"{}"];
            let bytes = *pick(dice, &kinds);
            ("no picture".into(), bytes.to_vec(), &["readable image"])
        }
        _ => {
            let ground = Scene::ground(3);
            (
                "the ground alone".into(),
                encoded(&ground.into(), ImageFormat::Png),
                &["nothing to grasp", "another photo", "hardly differs from its surroundings"],
            )
        }
    };
    (named(dice, &["png", "jpg", "tif", "bmp"], recipe, bytes), named_fields)
}
