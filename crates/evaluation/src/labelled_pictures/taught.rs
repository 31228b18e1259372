//! Where a picture shows what a model was taught from, pixel by pixel.

use image::RgbImage;
use nalgebra::{Point2, Vector2};
use sdg_grasp::TaughtDemonstration;

/// The middles of the grasps of those demonstrations that were cut from this very picture, in its pixels.
pub fn taught_grasps(picture: &RgbImage, demonstrations: &[TaughtDemonstration]) -> Vec<Point2<f64>> {
    let place = |demonstration: &TaughtDemonstration| {
        let [left, top] = find_exactly(picture, &demonstration.cutout)?;
        Some(demonstration.marks.grasp.center() + Vector2::new(f64::from(left), f64::from(top)))
    };
    demonstrations.iter().filter_map(place).collect()
}

/// Left and top of the first place at which the picture holds the cut-out without any difference.
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
    // The part crosses the middle row, so that even on a plain ground few places pass it.
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

#[cfg(test)]
mod tests {
    use super::*;
    use image::{Rgb, imageops};

    /// No two places look the same.
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
    fn a_cut_out_larger_than_the_picture_is_not_there() {
        let small = imageops::crop_imm(&picture(), 0, 0, 20, 10).to_image();
        assert_eq!(find_exactly(&small, &picture()), None);
    }
}
