//! Converts YUYV and padded rows to RGB.

use image::RgbImage;

/// Converts rows of YUYV (4:2:2: two pixels have common chroma) to RGB, with luma from 16 to 235 and BT.601's matrix,
/// the default of the USB video class. Integer arithmetic, with an error of at most one step.
///
/// # Errors
/// Text for a width that is odd or zero, or with the number of bytes found if the rows need more.
pub fn yuyv_to_rgb(bytes: &[u8], width: u32, height: u32, bytes_per_row: usize) -> Result<RgbImage, String> {
    if width == 0 || width % 2 == 1 {
        return Err(format!("an odd width of {width} pixels"));
    }
    let rows = rows(bytes, width as usize * 2, height, bytes_per_row)?;
    let mut pixels = vec![0; width as usize * height as usize * 3];
    for (row, pixels) in rows.zip(pixels.chunks_exact_mut(width as usize * 3)) {
        for (pair, rgb) in row.chunks_exact(4).zip(pixels.chunks_exact_mut(6)) {
            let [y0, u, y1, v] = [pair[0], pair[1], pair[2], pair[3]].map(i32::from);
            let (u, v) = (u - 128, v - 128);
            let [red, green, blue] = [409 * v + 128, 128 - 100 * u - 208 * v, 516 * u + 128];
            let [left, right] = [298 * (y0 - 16), 298 * (y1 - 16)];
            let channels = [left + red, left + green, left + blue, right + red, right + green, right + blue];
            for (byte, channel) in rgb.iter_mut().zip(channels) {
                *byte = (channel >> 8).clamp(0, 255) as u8;
            }
        }
    }
    RgbImage::from_raw(width, height, pixels).ok_or_else(|| format!("{width} × {height} pixels"))
}

/// Converts rows of RGB24, which may be padded.
///
/// # Errors
/// Text with the number of bytes found, if the rows need more.
pub(crate) fn rgb24_to_rgb(bytes: &[u8], width: u32, height: u32, bytes_per_row: usize) -> Result<RgbImage, String> {
    let rows = rows(bytes, width as usize * 3, height, bytes_per_row)?;
    let pixels = rows.flatten().copied().collect();
    RgbImage::from_raw(width, height, pixels).ok_or_else(|| format!("a width of {width} pixels"))
}

/// The used bytes of each row.
fn rows(bytes: &[u8], used: usize, height: u32, bytes_per_row: usize) -> Result<impl Iterator<Item = &[u8]>, String> {
    let stride = bytes_per_row.max(used);
    let needed = stride * (height as usize).saturating_sub(1) + used;
    if bytes.len() < needed {
        return Err(format!("{} of {needed} bytes", bytes.len()));
    }
    Ok((0..height as usize).map(move |row| &bytes[row * stride..row * stride + used]))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// BT.601's colour bars at 100 %: (Y, U, V) of the standard, and the corresponding RGB.
    const BARS: [([u8; 3], [u8; 3]); 8] = [
        ([235, 128, 128], [255, 255, 255]),
        ([210, 16, 146], [255, 255, 0]),
        ([170, 166, 16], [0, 255, 255]),
        ([145, 54, 34], [0, 255, 0]),
        ([106, 202, 222], [255, 0, 255]),
        ([81, 90, 240], [255, 0, 0]),
        ([41, 240, 110], [0, 0, 255]),
        ([16, 128, 128], [0, 0, 0]),
    ];

    /// The standard's bars are rounded to whole steps of YUV, which correspond to up to two steps of RGB.
    const ROUNDING: i32 = 2;

    #[test]
    fn the_colour_bars_of_the_standard_become_their_colours() {
        for ([y, u, v], expected) in BARS {
            let picture = yuyv_to_rgb(&[y, u, y, v], 2, 1, 4).unwrap();
            for pixel in picture.pixels() {
                let differs = (0..3).map(|c| (i32::from(pixel[c]) - i32::from(expected[c])).abs()).max().unwrap();
                assert!(differs <= ROUNDING, "{pixel:?} for {expected:?}");
            }
        }
        // Calculated by hand: 298 × (126 − 16) + 128 = 32908; / 256 = 128.
        assert_eq!(yuyv_to_rgb(&[126, 128, 126, 128], 2, 1, 4).unwrap().into_raw(), [128; 6]);
    }

    #[test]
    fn two_pixels_share_their_colour_and_padding_is_passed_over() {
        let row = [81, 90, 16, 240, 9, 9];
        let picture = yuyv_to_rgb(&[row, row].concat(), 2, 2, 6).unwrap();
        assert_eq!(picture.get_pixel(0, 1).0, [255, 0, 0]);
        // Calculated by hand, with luma 0: red 409 × 112 + 128 = 45936; / 256 = 179.
        assert_eq!(picture.get_pixel(1, 0).0, [179, 0, 0]);
        let padded = rgb24_to_rgb(&[1, 2, 3, 0, 4, 5, 6], 1, 2, 4).unwrap();
        assert_eq!(padded.into_raw(), [1, 2, 3, 4, 5, 6]);
    }

    #[test]
    fn short_buffers_are_refused_with_their_length() {
        assert_eq!(yuyv_to_rgb(&[0; 4 * 3 - 1], 2, 3, 4).unwrap_err(), "11 of 12 bytes");
        assert_eq!(rgb24_to_rgb(&[0; 17], 3, 2, 0).unwrap_err(), "17 of 18 bytes");
    }
}
