//! Finds a model's demonstrations in a picture: with identical pixels, or in a recompressed copy.

use image::RgbImage;
use nalgebra::{Point2, Vector2};
use sdg_grasp::TaughtDemonstration;

/// The grasp points of the demonstrations that were cut out of this picture, in its pixels.
pub fn taught_grasps(picture: &RgbImage, demonstrations: &[TaughtDemonstration]) -> Vec<Point2<f64>> {
    let place = |demonstration: &TaughtDemonstration| {
        let exactly = find_exactly(picture, &demonstration.cutout);
        let [left, top] = exactly.or_else(|| find_copy(picture, demonstration))?;
        Some(demonstration.marks.grasp.center() + Vector2::new(f64::from(left), f64::from(top)))
    };
    demonstrations.iter().filter_map(place).collect()
}

/// Left and top of the first position at which the picture equals the cut-out.
fn find_exactly(picture: &RgbImage, cutout: &RgbImage) -> Option<[u32; 2]> {
    const CHANNELS: usize = 3;
    let (width, height) = cutout.dimensions();
    if width == 0 || height == 0 || width > picture.width() || height > picture.height() {
        return None;
    }
    let row = |image: &'_ RgbImage, x: u32, y: u32| {
        let start = CHANNELS * (y as usize * image.width() as usize + x as usize);
        start..start + CHANNELS * width as usize
    };
    let same =
        |x: u32, y: u32, dy: u32| picture.as_raw()[row(picture, x, y + dy)] == cutout.as_raw()[row(cutout, 0, dy)];
    // The part crosses the middle row, so few positions pass this test even on a plain background.
    let middle = height / 2;
    for y in 0..=picture.height() - height {
        for x in 0..=picture.width() - width {
            if same(x, y, middle) && (0..height).all(|dy| same(x, y, dy)) {
                return Some([x, y]);
            }
        }
    }
    None
}

/// Maximum mean difference between a copy and the photo, in 8-bit levels; a JPEG of quality 50 causes about 4.
const MAX_COPY_DIFFERENCE: f64 = 5.0;

/// Left and top of the cut-out in a recompressed copy of the whole photo, of the same size; `None` if the picture is
/// not such a copy.
fn find_copy(picture: &RgbImage, demonstration: &TaughtDemonstration) -> Option<[u32; 2]> {
    let middle = demonstration.marks.photo_middle?;
    let side = |size: u32, middle: f64| {
        let start = 0.5 * f64::from(size) - middle;
        (start >= 0.0).then_some(start.round() as u32)
    };
    let [left, top] = [side(picture.width(), middle[0])?, side(picture.height(), middle[1])?];
    is_copy(picture, &demonstration.cutout, [left, top]).then_some([left, top])
}

fn is_copy(picture: &RgbImage, cutout: &RgbImage, [left, top]: [u32; 2]) -> bool {
    if left + cutout.width() > picture.width() || top + cutout.height() > picture.height() {
        return false;
    }
    let difference = |(x, y, pixel): (u32, u32, &image::Rgb<u8>)| {
        let here = picture.get_pixel(left + x, top + y);
        here.0.iter().zip(pixel.0).map(|(&one, other)| f64::from(one.abs_diff(other))).sum::<f64>() / 3.0
    };
    let count = f64::from(cutout.width()) * f64::from(cutout.height());
    cutout.enumerate_pixels().map(difference).sum::<f64>() <= MAX_COPY_DIFFERENCE * count
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::{Rgb, imageops};

    /// A picture in which no two places are equal.
    fn picture() -> RgbImage {
        RgbImage::from_fn(60, 40, |x, y| Rgb([(x * 4) as u8, (y * 6) as u8, (x * y) as u8]))
    }

    #[test]
    fn a_cut_out_is_found_where_it_was_cut_and_nowhere_after_one_pixel_changed() {
        let picture = picture();
        for (x, y) in [(0, 0), (17, 23), (40, 30)] {
            let cutout = imageops::crop_imm(&picture, x, y, 20, 10).to_image();
            assert_eq!(find_exactly(&picture, &cutout), Some([x, y]));
            let mut other = cutout;
            other.put_pixel(3, 9, Rgb([1, 2, 3]));
            assert_eq!(find_exactly(&picture, &other), None);
        }
    }

    #[test]
    fn a_copy_that_was_compressed_is_the_same_picture_and_one_moved_by_some_pixels_is_not() {
        let texture = |x: u32, y: u32| {
            let wave = |at: f64| (90.0 + 60.0 * at.sin()) as u8;
            Rgb([
                wave(f64::from(x) * 0.31),
                wave(f64::from(y) * 0.23 + f64::from(x) * 0.11),
                wave(f64::from(x + y) * 0.17),
            ])
        };
        let photo = RgbImage::from_fn(160, 120, texture);
        let mut jpeg = Vec::new();
        image::codecs::jpeg::JpegEncoder::new_with_quality(&mut jpeg, 60).encode_image(&photo).unwrap();
        let copy = image::load_from_memory(&jpeg).unwrap().into_rgb8();
        let cutout = imageops::crop_imm(&photo, 40, 30, 70, 50).to_image();
        assert_eq!(find_exactly(&copy, &cutout), None);
        assert!(is_copy(&copy, &cutout, [40, 30]));
        assert!(!is_copy(&copy, &cutout, [46, 34]) && !is_copy(&copy, &cutout, [120, 30]));
    }

    #[test]
    fn a_cut_out_larger_than_the_picture_is_not_there() {
        let small = imageops::crop_imm(&picture(), 0, 0, 20, 10).to_image();
        assert_eq!(find_exactly(&small, &picture()), None);
    }
}
