//! Converts samples of any depth, with alpha, to 8-bit RGB.

use image::{DynamicImage, ImageBuffer, Pixel, Rgb, RgbImage};

/// Common bit depths of cameras, stored in 16 bits.
const CAMERA_BITS: [u32; 3] = [8, 10, 12];
/// Maximum value of floats that count as overexposed. By convention, floats are 1 at full brightness; up to this
/// maximum they are slightly overexposed, and above it they are integers stored as floats.
const MAX_OVEREXPOSED: f32 = 2.0;
/// Alpha is used only if at least one alpha value in the picture reaches this limit. If all values are smaller, alpha
/// is unset, a mask of 0 and 1, or fractions truncated to integers; compositing with these values would give a white
/// picture.
const MIN_SEEN_ALPHA: u8 = 8;

/// Converts the samples, and composites transparent pixels over white.
pub(crate) fn to_rgb8(picture: DynamicImage) -> RgbImage {
    let picture = in_full_range(picture);
    if picture.color().has_alpha() { over_white(&picture) } else { picture.into_rgb8() }
}

/// Scales samples to the full range. Industrial cameras store 10 and 12 bits in the lower bits of 16; read as 16 bits,
/// the picture is nearly black. A dark picture that really has 16 bits becomes brighter, which does not affect later
/// steps.
fn in_full_range(mut picture: DynamicImage) -> DynamicImage {
    match &mut picture {
        DynamicImage::ImageLuma16(samples) => stretch(samples, 1),
        DynamicImage::ImageLumaA16(samples) => stretch(samples, 1),
        DynamicImage::ImageRgb16(samples) => stretch(samples, 3),
        DynamicImage::ImageRgba16(samples) => stretch(samples, 3),
        DynamicImage::ImageRgb32F(samples) => to_shares(samples),
        DynamicImage::ImageRgba32F(samples) => to_shares(samples),
        _ => {}
    }
    picture
}

/// Scales the first `num_colors` samples of each pixel so that the camera's maximum value becomes 65535.
fn stretch<P: Pixel<Subpixel = u16>>(picture: &mut ImageBuffer<P, Vec<u16>>, num_colors: usize) {
    let largest = picture.pixels().flat_map(|pixel| &pixel.channels()[..num_colors]).copied().max().unwrap_or(0);
    let Some(bits) = CAMERA_BITS.into_iter().find(|bits| u32::from(largest) < 1 << bits) else { return };
    // Eight bits stretched to 16 already have the correct brightness.
    if picture.pixels().flat_map(|pixel| &pixel.channels()[..num_colors]).all(|value| value % 257 == 0) {
        return;
    }
    let full = (1_u32 << bits) - 1;
    for pixel in picture.pixels_mut() {
        for sample in &mut pixel.channels_mut()[..num_colors] {
            *sample = ((u32::from(*sample) * 65535 + full / 2) / full) as u16;
        }
    }
}

/// Divides floats that are integers of 8, 10, 12 or 16 bits by the maximum of that depth, and larger ones by the
/// largest of them. Alpha is treated like the colours.
fn to_shares<P: Pixel<Subpixel = f32>>(picture: &mut ImageBuffer<P, Vec<f32>>) {
    let largest = picture.iter().copied().filter(|sample| sample.is_finite()).fold(0.0, f32::max);
    if largest <= MAX_OVEREXPOSED {
        return;
    }
    let full = CAMERA_BITS.into_iter().map(|bits| ((1_u32 << bits) - 1) as f32).find(|full| largest <= *full);
    let full = full.unwrap_or(largest.max(f32::from(u16::MAX)));
    picture.iter_mut().for_each(|sample| *sample /= full);
}

fn over_white(picture: &DynamicImage) -> RgbImage {
    let rgba = picture.to_rgba8();
    // Simulators, ROS and Windows leave an unset alpha of 0.
    if rgba.pixels().all(|pixel| pixel[3] < MIN_SEEN_ALPHA) {
        return picture.to_rgb8();
    }
    RgbImage::from_fn(rgba.width(), rgba.height(), |x, y| {
        let [r, g, b, a] = rgba.get_pixel(x, y).0.map(u32::from);
        Rgb([r, g, b].map(|value| ((value * a + 255 * (255 - a) + 127) / 255) as u8))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::{Luma, Rgba};

    #[test]
    fn ten_and_twelve_bits_in_sixteen_are_as_bright_as_eight() {
        for (bits, largest) in [(8, 255_u32), (10, 1023), (12, 4095), (16, 65535)] {
            let samples = ImageBuffer::<Luma<u16>, _>::from_fn(256, 1, |x, _| Luma([(x * largest / 255) as u16]));
            let read = to_rgb8(samples.into());
            assert!((0..256).all(|x| read.get_pixel(x, 0)[0].abs_diff(x as u8) <= 1), "{bits} bits");
        }
        let dark = ImageBuffer::<Luma<u16>, _>::from_fn(16, 1, |x, _| Luma([x as u16 * 257]));
        assert_eq!(to_rgb8(dark.into()).get_pixel(9, 0).0, [9; 3]);
        let black = ImageBuffer::<Luma<u16>, _>::from_pixel(4, 4, Luma([0]));
        assert_eq!(to_rgb8(black.into()).get_pixel(1, 1).0, [0; 3]);
        let color = ImageBuffer::<Rgba<u16>, _>::from_pixel(4, 4, Rgba([4095, 2047, 0, 65535]));
        assert_eq!(to_rgb8(color.into()).get_pixel(1, 1).0, [255, 127, 0]);
    }

    #[test]
    fn floats_that_are_integers_are_as_bright_as_eight_bits() {
        for largest in [1.0_f32, 255.0, 1023.0, 4095.0, 65535.0] {
            let samples = ImageBuffer::<Rgb<f32>, _>::from_fn(256, 1, |x, _| Rgb([x as f32 * largest / 255.0; 3]));
            let read = to_rgb8(samples.into());
            assert!((0..256).all(|x| read.get_pixel(x, 0)[0].abs_diff(x as u8) <= 1), "to {largest}");
        }
        // A highlight above white is clipped and does not darken the picture.
        let bright = ImageBuffer::<Rgb<f32>, _>::from_fn(2, 1, |x, _| Rgb([if x == 0 { 1.5 } else { 0.5 }; 3]));
        let read = to_rgb8(bright.into());
        assert_eq!([read.get_pixel(0, 0).0, read.get_pixel(1, 0).0], [[255; 3], [128; 3]]);
    }

    #[test]
    fn an_alpha_that_nobody_set_is_passed_over() {
        let pixel = |alpha: u8| Rgba([10, 20, 30, alpha]);
        let mut picture = image::RgbaImage::from_pixel(4, 3, pixel(0));
        assert_eq!(to_rgb8(picture.clone().into()).get_pixel(1, 1).0, [10, 20, 30]);
        // A mask of 0 and 1, or an opacity of 1.0 that became an integer.
        picture.pixels_mut().enumerate().for_each(|(idx, pixel)| pixel[3] = (idx % 2) as u8);
        assert_eq!(to_rgb8(picture.clone().into()).get_pixel(1, 1).0, [10, 20, 30]);
        let mut picture = image::RgbaImage::from_pixel(4, 3, pixel(0));
        picture.put_pixel(0, 0, pixel(255));
        let cut_out = to_rgb8(picture.into());
        assert_eq!([cut_out.get_pixel(0, 0).0, cut_out.get_pixel(1, 1).0], [[10, 20, 30], [255; 3]]);
    }
}
