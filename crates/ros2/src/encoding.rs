//! Pictures in messages: the encodings of sensor_msgs/Image, and CompressedImage.

use image::{ImageFormat, RgbImage};
use sdg_camera::{PixelFrame, decode_picture, yuyv_to_rgb};

use crate::error::PictureError;
use crate::messages::{CompressedImage, Header, Image};

/// Largest width or height in pixels.
pub const MAX_SIDE: u32 = 1 << 14;
/// Maximum number of bytes of a picture or its message, 64 MiB: 22 megapixels of three bytes. RustDDS is slow even for
/// much smaller pictures.
pub const MAX_BYTES: usize = 64 << 20;

/// The layout of a message's pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Layout {
    /// Bytes per pixel, and the positions of red, green and blue among them.
    Channels(usize, [usize; 3]),
    /// Numbers of two bytes, of which the high byte is used.
    Grey16,
    /// Two pixels as the bytes Y0 U Y1 V.
    Yuyv,
    /// Two pixels as the bytes U Y0 V Y1.
    Uyvy,
}

/// The supported encodings, with their names in `sensor_msgs/image_encodings.hpp`.
const LAYOUTS: [(&str, Layout); 14] = [
    ("rgb8", Layout::Channels(3, [0, 1, 2])),
    ("bgr8", Layout::Channels(3, [2, 1, 0])),
    ("8UC3", Layout::Channels(3, [2, 1, 0])),
    ("rgba8", Layout::Channels(4, [0, 1, 2])),
    ("bgra8", Layout::Channels(4, [2, 1, 0])),
    ("8UC4", Layout::Channels(4, [2, 1, 0])),
    ("mono8", Layout::Channels(1, [0, 0, 0])),
    ("8UC1", Layout::Channels(1, [0, 0, 0])),
    ("mono16", Layout::Grey16),
    ("16UC1", Layout::Grey16),
    ("yuv422_yuy2", Layout::Yuyv),
    ("yuyv", Layout::Yuyv),
    ("yuv422", Layout::Uyvy),
    ("uyvy", Layout::Uyvy),
];

impl Layout {
    fn bytes_per_row(self, width: usize) -> usize {
        match self {
            Self::Channels(bytes, _) => bytes * width,
            Self::Grey16 | Self::Yuyv | Self::Uyvy => 2 * width,
        }
    }
}

fn refused(expected: impl Into<String>, found: impl ToString) -> PictureError {
    PictureError { expected: expected.into(), found: found.to_string() }
}

/// Decodes the picture of a message.
///
/// # Errors
/// [`PictureError`] for an unsupported encoding, an invalid size, and rows that do not match the bytes.
pub fn read_image(message: &Image) -> Result<RgbImage, PictureError> {
    let Image { width, height, step, data, .. } = message;
    let Some((_, layout)) = LAYOUTS.iter().find(|(name, _)| *name == message.encoding) else {
        let names: Vec<&str> = LAYOUTS.iter().map(|(name, _)| *name).collect();
        return Err(refused(format!("one of the encodings {}", names.join(", ")), format!("\"{}\"", message.encoding)));
    };
    if !(1..=MAX_SIDE).contains(width) || !(1..=MAX_SIDE).contains(height) {
        return Err(refused(format!("sides of 1 to {MAX_SIDE} pixels"), format!("{width} × {height}")));
    }
    let (columns, rows, step) = (*width as usize, *height as usize, *step as usize);
    let used = layout.bytes_per_row(columns);
    if step < used {
        return Err(refused(
            format!("a step of at least {used} bytes for {width} pixels of {}", message.encoding),
            step,
        ));
    }
    let needed = step * (rows - 1) + used;
    if needed.max(3 * columns * rows) > MAX_BYTES {
        return Err(refused(format!("a picture of at most {} MiB", MAX_BYTES >> 20), format!("{width} × {height}")));
    }
    if data.len() < needed {
        let bytes = format!("{needed} bytes for {width} × {height} pixels of {}", message.encoding);
        return Err(refused(bytes, data.len()));
    }
    if matches!(layout, Layout::Yuyv | Layout::Uyvy) && columns % 2 == 1 {
        return Err(refused(format!("an even width for {}", message.encoding), width));
    }
    let lines = (0..rows).map(|row| &data[row * step..row * step + used]);
    let pixels: Vec<u8> = match *layout {
        Layout::Channels(3, [0, 1, 2]) => lines.flatten().copied().collect(),
        Layout::Channels(bytes, [red, green, blue]) => lines
            .flat_map(|line| line.chunks_exact(bytes))
            .flat_map(|pixel| [pixel[red], pixel[green], pixel[blue]])
            .collect(),
        Layout::Grey16 => {
            let high = usize::from(message.is_bigendian == 0);
            lines.flat_map(|line| line.chunks_exact(2)).flat_map(|pixel| [pixel[high]; 3]).collect()
        }
        Layout::Yuyv => return yuyv_to_rgb(data, *width, *height, step).map_err(|found| refused("whole rows", found)),
        Layout::Uyvy => {
            let swapped: Vec<u8> =
                lines.flat_map(|line| line.chunks_exact(2)).flat_map(|pair| [pair[1], pair[0]]).collect();
            return yuyv_to_rgb(&swapped, *width, *height, used).map_err(|found| refused("whole rows", found));
        }
    };
    RgbImage::from_raw(*width, *height, pixels).ok_or_else(|| refused("as many pixels as its size states", "fewer"))
}

/// Decodes the picture of a compressed message: JPEG or PNG, which is detected by the first bytes.
///
/// # Errors
/// [`PictureError`] for another format, and for bytes that cannot be decoded.
pub fn read_compressed(message: &CompressedImage) -> Result<RgbImage, PictureError> {
    // image_transport's depth pictures have their own header before the PNG.
    if message.format.contains("compressedDepth") {
        return Err(refused("jpeg or png of a colour camera", format!("\"{}\"", message.format)));
    }
    match message.data.as_slice() {
        [0xff, 0xd8, ..] | [0x89, b'P', b'N', b'G', ..] => {}
        _ => return Err(refused("jpeg or png", format!("\"{}\" of {} bytes", message.format, message.data.len()))),
    }
    // camera_info describes the sensor's pixels.
    decode_picture(&message.data, PixelFrame::Sensor).map_err(|found| refused("a whole picture", found))
}

/// Encodes a picture as `rgb8`.
pub fn to_image(picture: &RgbImage, header: Header) -> Image {
    Image {
        header,
        height: picture.height(),
        width: picture.width(),
        encoding: "rgb8".to_owned(),
        is_bigendian: 0,
        step: 3 * picture.width(),
        data: picture.as_raw().clone(),
    }
}

/// Encodes a picture as JPEG; `None` for a picture without pixels.
pub fn to_compressed(picture: &RgbImage, header: Header) -> Option<CompressedImage> {
    let mut data = std::io::Cursor::new(Vec::new());
    picture.write_to(&mut data, ImageFormat::Jpeg).ok()?;
    Some(CompressedImage { header, format: "rgb8; jpeg compressed bgr8".to_owned(), data: data.into_inner() })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn message(encoding: &str, width: u32, height: u32, step: u32, data: &[u8]) -> Image {
        Image { encoding: encoding.to_owned(), width, height, step, data: data.to_vec(), ..Image::default() }
    }

    #[test]
    fn channels_are_put_in_their_order_and_padding_is_passed_over() {
        for (encoding, row, expected) in [
            ("rgb8", vec![1, 2, 3, 9], [1, 2, 3]),
            ("bgr8", vec![3, 2, 1, 9], [1, 2, 3]),
            ("rgba8", vec![1, 2, 3, 255], [1, 2, 3]),
            ("bgra8", vec![3, 2, 1, 255], [1, 2, 3]),
            ("mono8", vec![7, 9, 9, 9], [7, 7, 7]),
            ("mono16", vec![9, 7, 0, 0], [7, 7, 7]),
        ] {
            let twice = [row.clone(), row].concat();
            let picture = read_image(&message(encoding, 1, 2, 4, &twice)).unwrap();
            assert_eq!(picture.into_raw(), [expected, expected].concat(), "{encoding}");
        }
        let big = Image { is_bigendian: 1, ..message("mono16", 1, 1, 2, &[7, 9]) };
        assert_eq!(read_image(&big).unwrap().into_raw(), [7, 7, 7]);
    }

    #[test]
    fn both_orders_of_yuv_are_the_same_picture() {
        // The red of BT.601's colour bars.
        let yuyv = read_image(&message("yuv422_yuy2", 2, 1, 4, &[81, 90, 81, 240])).unwrap();
        let uyvy = read_image(&message("yuv422", 2, 1, 4, &[90, 81, 240, 81])).unwrap();
        assert_eq!(yuyv, uyvy);
        assert_eq!(yuyv.get_pixel(0, 0).0, [255, 0, 0]);
    }

    #[test]
    fn what_does_not_fit_is_refused_with_what_was_expected() {
        for (wrong, expected) in [
            (message("bayer_rggb8", 2, 2, 2, &[0; 4]), "found \"bayer_rggb8\""),
            (message("rgb8", 0, 2, 6, &[0; 12]), "sides of 1 to 16384 pixels, found 0 × 2"),
            (message("rgb8", 1, u32::MAX, 3, &[]), "sides of 1 to 16384"),
            (message("rgb8", 2, 2, 5, &[0; 12]), "a step of at least 6 bytes for 2 pixels of rgb8, found 5"),
            (message("rgb8", 2, 2, 6, &[0; 11]), "12 bytes for 2 × 2 pixels of rgb8, found 11"),
            (message("rgb8", 2, 2, u32::MAX, &[0; 12]), "at most 64 MiB"),
            (message("mono8", 16384, 16384, 16384, &[0; 1]), "at most 64 MiB"),
            (message("yuyv", 3, 1, 6, &[0; 6]), "an even width for yuyv, found 3"),
        ] {
            let error = read_image(&wrong).unwrap_err().to_string();
            assert!(error.contains(expected), "{error}");
        }
    }

    #[test]
    fn compressed_pictures_come_back_and_others_are_refused() {
        let picture = RgbImage::from_fn(16, 8, |x, y| image::Rgb([(x * 15) as u8, (y * 30) as u8, 90]));
        let jpeg = to_compressed(&picture, Header::default()).unwrap();
        assert_eq!(read_compressed(&jpeg).unwrap().dimensions(), (16, 8));
        let mut png = std::io::Cursor::new(Vec::new());
        picture.write_to(&mut png, ImageFormat::Png).unwrap();
        let png = CompressedImage { format: "png".into(), data: png.into_inner(), ..CompressedImage::default() };
        assert_eq!(read_compressed(&png).unwrap(), picture);
        let cut = CompressedImage { data: png.data[..60].to_vec(), ..png.clone() };
        assert!(read_compressed(&cut).is_err());
        let other = CompressedImage { format: "tiff".into(), data: vec![1; 9], ..png.clone() };
        assert_eq!(read_compressed(&other).unwrap_err().to_string(), "expected jpeg or png, found \"tiff\" of 9 bytes");
        let depth = CompressedImage { format: "16UC1; compressedDepth png".into(), ..png };
        assert!(read_compressed(&depth).unwrap_err().to_string().contains("colour camera"));
    }

    #[test]
    fn a_picture_is_the_same_after_a_message() {
        let picture = RgbImage::from_fn(3, 2, |x, y| image::Rgb([x as u8, y as u8, 5]));
        assert_eq!(read_image(&to_image(&picture, Header::default())).unwrap(), picture);
    }
}
