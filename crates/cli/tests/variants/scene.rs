//! A small picture of one part with its marks, with 256 colours, so that a palette represents it without loss.

use image::{Rgb, RgbImage};
use nalgebra::{Point2, Rotation2, Vector2};
use sdg_demonstration::random::scramble;

pub const WIDTH: u32 = 320;
pub const HEIGHT: u32 = 240;

/// A bar with a tooth and a head, without rotational symmetry; pixels from its pivot.
const PART: [[f64; 2]; 12] = [
    [-55.0, -9.0],
    [-20.0, -9.0],
    [-20.0, -17.0],
    [-8.0, -17.0],
    [-8.0, -9.0],
    [35.0, -9.0],
    [35.0, -26.0],
    [60.0, -20.0],
    [60.0, 22.0],
    [35.0, 26.0],
    [35.0, 9.0],
    [-55.0, 9.0],
];
const GRASP: [[f64; 2]; 2] = [[-35.0, 0.0], [15.0, 0.0]];
/// Samples per pixel, horizontally and vertically.
const SUBPIXELS: u32 = 4;

/// A picture and its marks, in pixels.
#[derive(Debug, Clone)]
pub struct Scene {
    pub photo: RgbImage,
    pub outline: Vec<[f64; 2]>,
    /// Left, top, right, bottom.
    pub corners: [f64; 4],
    /// From start to end.
    pub grasp: [[f64; 2]; 2],
}

impl Scene {
    /// The part with its pivot at a position, rotated by an angle; the background depends only on the seed.
    pub fn new(pivot: [f64; 2], angle_deg: f64, seed: u64) -> Self {
        let rotation = Rotation2::new(angle_deg.to_radians());
        let pivot = Vector2::from(pivot);
        let placed = |point: [f64; 2]| {
            let point = rotation * Vector2::from(point) + pivot;
            // Rounded, because files contain few digits.
            [point.x, point.y].map(|value| (value * 16.0).round() / 16.0)
        };
        let outline: Vec<[f64; 2]> = PART.map(placed).to_vec();
        let polygon = sdg_geometry::Polygon { vertices: outline.iter().map(|point| Point2::from(*point)).collect() };
        let color = |x: u32, y: u32, is_part: bool, along: f64| {
            let noise = scramble(seed ^ u64::from(y * WIDTH + x)) % 25;
            let shade = noise as f64 - 12.0;
            match (is_part, along) {
                (true, ..-30.0) => [60.0, 70.0, 190.0 + shade],
                (true, ..20.0) => [200.0 + shade, 60.0, 40.0],
                (true, _) => [225.0, 170.0 + shade, 50.0],
                (false, _) => [95.0 + shade, 112.0 + shade, 120.0 + shade],
            }
        };
        let photo = RgbImage::from_fn(WIDTH, HEIGHT, |x, y| {
            let mut sum = [0.0; 3];
            for idx in 0..SUBPIXELS * SUBPIXELS {
                let at = |cell: u32, pixel: u32| f64::from(pixel) + (f64::from(cell) + 0.5) / f64::from(SUBPIXELS);
                let point = Point2::new(at(idx % SUBPIXELS, x), at(idx / SUBPIXELS, y));
                let along = (rotation.inverse() * (point.coords - pivot)).x;
                let one = color(x, y, polygon.contains(&point), along);
                (0..3).for_each(|channel| sum[channel] += one[channel] / f64::from(SUBPIXELS * SUBPIXELS));
            }
            color_of(number_of(sum))
        });
        let side =
            |axis: usize, pick: fn(f64, f64) -> f64| outline.iter().map(|point| point[axis]).reduce(pick).unwrap();
        let corners = [side(0, f64::min), side(1, f64::min), side(0, f64::max), side(1, f64::max)];
        Self { photo, corners, grasp: GRASP.map(placed), outline }
    }

    /// A picture without the part.
    pub fn ground(seed: u64) -> RgbImage {
        Self::new([-1000.0, -1000.0], 0.0, seed).photo
    }

    /// Middle and angle of the grasp, in pixels and degrees.
    pub fn middle_and_angle(&self) -> ([f64; 2], f64) {
        let [[x1, y1], [x2, y2]] = self.grasp;
        ([(x1 + x2) / 2.0, (y1 + y2) / 2.0], (y2 - y1).atan2(x2 - x1).to_degrees())
    }
}

/// The index of the nearest of the 256 colours: three bits of red, three of green, two of blue.
fn number_of(color: [f64; 3]) -> u8 {
    let level = |value: f64, largest: f64| (value.clamp(0.0, 255.0) / 255.0 * largest).round() as u8;
    level(color[0], 7.0) << 5 | level(color[1], 7.0) << 2 | level(color[2], 3.0)
}

/// The colour of an index.
pub fn color_of(number: u8) -> Rgb<u8> {
    let value = |level: u8, largest: u16| (u16::from(level) * 255 / largest) as u8;
    Rgb([value(number >> 5, 7), value(number >> 2 & 7, 7), value(number & 3, 3)])
}

/// The colour indices of a picture, row by row.
pub fn numbers_of(picture: &RgbImage) -> Vec<u8> {
    picture.pixels().map(|pixel| number_of(pixel.0.map(f64::from))).collect()
}
