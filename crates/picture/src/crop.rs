//! Crops of pictures for networks: the square around a detected box, or any rotated square.
//!
//! **Square**, because a crop of the box's own shape, stretched to the network's square input, would shear the part: a
//! bar at 30° in a wide box would appear at another angle, with an error that depends on the angle itself.
//!
//! **Its side is the box's diagonal**, with a margin. A part that is rotated in place changes its box; the longer side
//! of a bar's box is the bar's length times cos θ (up to θ = 45°), so a crop by the longer side would show the bar 1.4
//! times as large at 45° as at 0°. The diagonal of a bar's box is the bar's length at every angle, and the whole part
//! is inside for any error of the box within the margin.

use image::RgbImage;
use nalgebra::{Point2, Vector2};
use sdg_geometry::{Angle, BoundingBox};

/// Ratio of the crop's side to the box's diagonal: room for a small error of the box.
const SIDE_PER_DIAGONAL: f64 = 1.1;

/// Colour of a crop beyond the image: the mean colour of photos, which is zero in a network's input.
pub const OUTSIDE: [u8; 3] = [124, 116, 104];

/// Maximum number of samples averaged for one pixel of a crop, along each axis: enough for an eightfold reduction.
const MAX_TAPS: usize = 8;

/// A square of an image, possibly rotated: the area of a crop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CropWindow {
    /// Centre, in pixels of the image.
    pub center: Point2<f64>,
    /// Side, in pixels of the image.
    pub side: f64,
    /// Direction of the crop's x axis in the image; zero for detected boxes, arbitrary in training.
    pub turn: Angle,
}

impl CropWindow {
    /// The square around a box; `None` for a box without area or with a corner that is not finite.
    pub fn around(bbox: &BoundingBox) -> Option<Self> {
        let &BoundingBox { x1, y1, x2, y2 } = bbox;
        let usable = [x1, y1, x2, y2].iter().all(|value| value.is_finite()) && x1 < x2 && y1 < y2;
        let side = SIDE_PER_DIAGONAL * bbox.width().hypot(bbox.height());
        usable.then(|| Self { center: bbox.center(), side, turn: Angle::ZERO })
    }

    /// The direction in the crop that corresponds to a direction in the image.
    pub fn crop_angle(&self, image_angle: Angle) -> Angle {
        image_angle - self.turn
    }

    /// The position in the image that corresponds to a position in a crop of `size_px` pixels per side, both in pixels.
    pub fn image_point(&self, in_crop: &Point2<f64>, size_px: u32) -> Point2<f64> {
        let half = f64::from(size_px) / 2.0;
        let scale = self.side / f64::from(size_px);
        self.center + self.x_axis() * (scale * (in_crop.x - half)) + self.y_axis() * (scale * (in_crop.y - half))
    }

    /// Resamples the window to `size_px` × `size_px` pixels. When reducing by a factor of up to eight, it averages over
    /// each pixel's whole area, so a crop of a large image looks like a crop of a small image.
    pub fn read(&self, image: &RgbImage, size_px: u32) -> RgbImage {
        let scale = self.side / f64::from(size_px);
        let taps = (scale.ceil() as usize).clamp(1, MAX_TAPS);
        let step = |axis: Vector2<f64>| axis * (scale / taps as f64);
        let (x_axis, y_axis) = (self.x_axis(), self.y_axis());
        let (right, down) = (step(x_axis), step(y_axis));
        let share = 1.0 / (taps * taps) as f32;
        let half = f64::from(size_px) / 2.0;
        RgbImage::from_fn(size_px, size_px, |column, row| {
            let (across, along) = (f64::from(column) - half, f64::from(row) - half);
            let corner = self.center + x_axis * (scale * across) + y_axis * (scale * along);
            let mut sum = [0f32; 3];
            for tap_y in 0..taps {
                for tap_x in 0..taps {
                    let at = corner + right * (tap_x as f64 + 0.5) + down * (tap_y as f64 + 0.5);
                    let color = bilinear(image, at.x as f32, at.y as f32);
                    (0..3).for_each(|channel| sum[channel] += color[channel]);
                }
            }
            image::Rgb(sum.map(|value| rounded(value * share)))
        })
    }

    fn x_axis(&self) -> Vector2<f64> {
        let (sin, cos) = self.turn.radians().sin_cos();
        Vector2::new(cos, sin)
    }

    fn y_axis(&self) -> Vector2<f64> {
        let (sin, cos) = self.turn.radians().sin_cos();
        Vector2::new(-sin, cos)
    }
}

/// `f32::floor` without a call into the C library, which targets without a rounding instruction would need.
fn floor(value: f32) -> f32 {
    // Up to this value, the conversion to i32 and back is exact.
    if value.abs() > 8e6 {
        return value.floor();
    }
    let whole = value as i32 as f32;
    if whole > value { whole - 1.0 } else { whole }
}

/// `f32::round` of a colour, without a function call.
fn rounded(value: f32) -> u8 {
    let whole = value as u8;
    if value - f32::from(whole) >= 0.5 { whole.saturating_add(1) } else { whole }
}

/// The colour between four pixels, whose centres are at half-integers; [`OUTSIDE`] beyond the image.
///
/// The pretrained weights depend on this order of the sum. `sdg-shape`'s sampling cannot replace it: it rounds
/// differently and stops at the border.
fn bilinear(image: &RgbImage, x: f32, y: f32) -> [f32; 3] {
    let (width, height) = (image.width() as i32, image.height() as i32);
    let (left, top) = (floor(x - 0.5), floor(y - 0.5));
    let (fx, fy) = (x - 0.5 - left, y - 0.5 - top);
    let (left, top) = (left as i32, top as i32);
    let weights = [(1.0 - fx) * (1.0 - fy), fx * (1.0 - fy), (1.0 - fx) * fy, fx * fy];
    let mean = |colors: [[u8; 3]; 4]| -> [f32; 3] {
        std::array::from_fn(|c| {
            let terms: [f32; 4] = std::array::from_fn(|i| weights[i] * f32::from(colors[i][c]));
            terms[0] + terms[1] + terms[2] + terms[3]
        })
    };
    if left >= 0 && top >= 0 && left < width - 1 && top < height - 1 {
        let stride = 3 * width as usize;
        let first = top as usize * stride + 3 * left as usize;
        let pair = |first: usize| -> [[u8; 3]; 2] {
            let &[r, g, b, r2, g2, b2] = image.as_raw()[first..].first_chunk().expect("two pixels of a row");
            [[r, g, b], [r2, g2, b2]]
        };
        let ([a, b], [c, d]) = (pair(first), pair(first + stride));
        return mean([a, b, c, d]);
    }
    mean(std::array::from_fn(|i| {
        let (column, row) = (left.saturating_add((i % 2) as i32), top.saturating_add((i / 2) as i32));
        let inside = (0..width).contains(&column) && (0..height).contains(&row);
        if inside { image.get_pixel(column as u32, row as u32).0 } else { OUTSIDE }
    }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::Rgb;

    fn boxed(x1: f64, y1: f64, x2: f64, y2: f64) -> BoundingBox {
        BoundingBox { x1, y1, x2, y2 }
    }

    #[test]
    fn the_square_has_the_boxs_centre_and_its_diagonal() {
        let window = CropWindow::around(&boxed(10.0, 20.0, 40.0, 60.0)).unwrap();
        assert_eq!(window.center, Point2::new(25.0, 40.0));
        // A 3-4-5 triangle: 50 px, plus ten per cent.
        assert!((window.side - 55.0).abs() < 1e-9);
        let corner = window.image_point(&Point2::new(0.0, 0.0), 64);
        assert!((corner - Point2::new(-2.5, 12.5)).norm() < 1e-9, "{corner}");
    }

    #[test]
    fn a_bar_has_the_same_size_at_every_angle() {
        for degrees in [0.0f64, 20.0, 45.0, 80.0, 90.0] {
            let (sin, cos) = degrees.to_radians().sin_cos();
            // A line of 100 px with a little width, so that its box has an area.
            let bar = boxed(0.0, 0.0, 100.0 * cos + 0.01, 100.0 * sin + 0.01);
            let side = CropWindow::around(&bar).unwrap().side;
            assert!((side - 110.0).abs() < 0.1, "{degrees}: {side}");
        }
    }

    #[test]
    fn a_crop_shows_what_the_window_covers() {
        // The right half of the image is red; the box's centre is on the border between the halves.
        let image = RgbImage::from_fn(80, 60, |x, _| Rgb(if x < 40 { [0, 0, 0] } else { [200, 0, 0] }));
        let crop = CropWindow::around(&boxed(35.0, 25.0, 45.0, 35.0)).unwrap().read(&image, 16);
        assert_eq!(crop.dimensions(), (16, 16));
        assert!((0..16).all(|y| crop.get_pixel(0, y).0 == [0, 0, 0] && crop.get_pixel(15, y).0 == [200, 0, 0]));
    }

    #[test]
    fn a_turned_window_turns_what_it_shows_back() {
        // Brighter along +y: if the x axis of the crop points along the image's +y, the crop is brighter along its +x.
        let image = RgbImage::from_fn(60, 60, |_, y| Rgb([4 * y as u8; 3]));
        let window = CropWindow { center: Point2::new(30.0, 30.0), side: 20.0, turn: Angle::from_degrees(90.0) };
        let crop = window.read(&image, 10);
        assert_eq!(crop.get_pixel(2, 1), crop.get_pixel(2, 8));
        assert!(crop.get_pixel(8, 5)[0] > crop.get_pixel(2, 5)[0] + 30);
        // The image's direction "down" is the crop's direction "right".
        assert!(window.crop_angle(Angle::from_degrees(90.0)).degrees().abs() < 1e-9);
    }

    #[test]
    fn shrinking_averages() {
        // Stripes of one pixel, shrunk to a quarter, become one grey.
        let image = RgbImage::from_fn(200, 200, |x, _| Rgb([if x % 2 == 0 { 0 } else { 200 }; 3]));
        let window = CropWindow { center: Point2::new(100.0, 100.0), side: 80.0, turn: Angle::ZERO };
        let crop = window.read(&image, 20);
        assert!(crop.pixels().all(|pixel| (98..=102).contains(&pixel[0])), "{:?}", crop.get_pixel(3, 3));
    }

    #[test]
    fn floor_and_rounding_are_those_of_the_standard_library() {
        for value in [-7.5f32, -1.0, -0.25, 0.0, 0.999_999_94, 3.0, 640.75, 7.999_999e6, -9e9, f32::INFINITY] {
            assert_eq!(floor(value), value.floor());
        }
        for value in [0.0f32, 0.499_999_97, 0.5, 1.5, 2.499_999_8, 254.5, 255.0, 255.4, 300.0] {
            assert_eq!(rounded(value), value.round() as u8, "{value}");
        }
    }

    #[test]
    fn beyond_the_image_lies_the_mean_colour() {
        let crop = CropWindow::around(&boxed(-10.0, -10.0, 10.0, 10.0)).unwrap().read(&RgbImage::new(20, 20), 8);
        assert_eq!(crop.get_pixel(0, 0).0, OUTSIDE);
        assert_eq!(crop.get_pixel(6, 6).0, [0, 0, 0]);
    }

    #[test]
    fn boxes_without_sense_have_no_window() {
        for bad in [boxed(5.0, 5.0, 5.0, 9.0), boxed(5.0, 5.0, 3.0, 9.0), boxed(f64::NAN, 0.0, 9.0, 9.0)] {
            assert!(CropWindow::around(&bad).is_none(), "{bad:?}");
        }
    }
}
