//! Pictures of boards with ground truth, bit-identical on every machine: they use only operations that IEEE 754 rounds
//! exactly.
//!
//! Every pixel is the mean over its area. The lens is inverted at the corners of the pixels and approximated as linear
//! within a pixel.
#![allow(dead_code)]

pub mod cameras;

use image::{GrayImage, Luma};
use nalgebra::{Isometry3, Point2, Point3, Quaternion, Translation3, UnitQuaternion};
use sdg_calibration::Board;
use sdg_geometry::PinholeCamera;

/// SplitMix64: a generator that does not change with the version of a crate.
#[derive(Debug, Clone)]
pub struct Random(pub u64);

impl Random {
    /// Uniform in [0, 1).
    pub fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut bits = self.0;
        bits = (bits ^ (bits >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        bits = (bits ^ (bits >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((bits ^ (bits >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Uniform between two bounds.
    pub fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// Nearly normal with standard deviation 1: the sum of twelve uniform numbers, which needs no logarithm.
    pub fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.unit()).sum::<f64>() - 6.0
    }
}

/// The degradations of a picture.
#[derive(Debug, Clone, Copy)]
pub struct Exposure {
    /// Brightness of ink and paper, of 255.
    pub ink: f64,
    pub paper: f64,
    /// Relative darkening of the right border.
    pub falloff: f64,
    /// Number of applications of the binomial 3 × 3 kernel: each adds a variance of 0.5 px².
    pub blur: u32,
    /// Standard deviation of the noise.
    pub noise: f64,
}

impl Exposure {
    pub const ORDINARY: Self = Self { ink: 35.0, paper: 215.0, falloff: 0.25, blur: 1, noise: 2.0 };
}

/// A rotation about `axis`, given by the tangent of half the angle. No sine is needed: the rounding of a sine depends
/// on the machine.
pub fn turn(axis: [f64; 3], half_tangent: f64) -> UnitQuaternion<f64> {
    let [x, y, z] = axis.map(|value| value * half_tangent);
    UnitQuaternion::from_quaternion(Quaternion::new(1.0, x, y, z))
}

/// The board's pose: its centre is at `pixel` (without lens distortion), at `distance_m` along the axis; it is rotated
/// in the picture by `roll`, then tilted about the picture's x and y. All angles are given as tangents of half angles.
pub fn camera_from_board(
    board: &Board,
    camera: &PinholeCamera,
    pixel: [f64; 2],
    distance_m: f64,
    [tilt_x, tilt_y, roll]: [f64; 3],
) -> Isometry3<f64> {
    let facing = UnitQuaternion::from_quaternion(Quaternion::new(0.0, 1.0, 0.0, 0.0));
    let tilt = turn([0.0, 1.0, 0.0], tilt_y) * turn([1.0, 0.0, 0.0], tilt_x);
    let rotation = tilt * turn([0.0, 0.0, 1.0], roll) * facing;
    let center = Point3::new(board.center().x, board.center().y, 0.0);
    let [x, y] =
        [(pixel[0] - camera.cx) / camera.fx, (pixel[1] - camera.cy) / camera.fy].map(|value| value * distance_m);
    let translation = Point3::new(x, y, distance_m) - rotation * center;
    Isometry3::from_parts(Translation3::from(translation), rotation)
}

/// The board in a picture; the table around the sheet is grey.
pub fn render(
    board: &Board,
    camera: &PinholeCamera,
    camera_from_board: &Isometry3<f64>,
    exposure: &Exposure,
    random: &mut Random,
) -> GrayImage {
    render_with(&|place| board.is_inked(place), board, camera, camera_from_board, exposure, random)
}

/// Like [`render`], with another print: `is_inked` takes points in sides of a square.
pub fn render_with(
    is_inked: &dyn Fn(&Point2<f64>) -> bool,
    board: &Board,
    camera: &PinholeCamera,
    camera_from_board: &Isometry3<f64>,
    exposure: &Exposure,
    random: &mut Random,
) -> GrayImage {
    let (width, height) = (camera.width as usize, camera.height as usize);
    let board_from_camera = camera_from_board.inverse();
    let origin = board_from_camera.translation.vector;
    let place = |x: usize, y: usize| {
        let direction = board_from_camera.rotation * camera.unproject(&Point2::new(x as f64, y as f64))?.coords;
        let depth = -origin.z / direction.z;
        let hit = origin + direction * depth;
        (depth > 0.0).then(|| Point2::new(hit.x, hit.y) / board.square_m())
    };
    let places: Vec<Option<Point2<f64>>> =
        (0..=height).flat_map(|y| (0..=width).map(move |x| (x, y))).map(|(x, y)| place(x, y)).collect();
    let brightness = |place: &Point2<f64>| {
        let [columns, rows] = [board.columns(), board.rows()].map(f64::from);
        let on_sheet = (-1.0..columns + 1.0).contains(&place.x) && (-1.0..rows + 1.0).contains(&place.y);
        match (is_inked(place), on_sheet) {
            (true, _) => exposure.ink,
            (false, true) => exposure.paper,
            (false, false) => 0.5 * (exposure.ink + exposure.paper),
        }
    };
    // A corner belongs to up to four pixels; its brightness is computed once.
    let places: Vec<Option<(Point2<f64>, f64)>> =
        places.into_iter().map(|place| place.map(|place| (place, brightness(&place)))).collect();
    let mut values = vec![0.5 * (exposure.ink + exposure.paper); width * height];
    for y in 0..height {
        for x in 0..width {
            let at = |dx: usize, dy: usize| places[(y + dy) * (width + 1) + x + dx];
            let (Some(a), Some(b), Some(c), Some(d)) = (at(0, 0), at(1, 0), at(0, 1), at(1, 1)) else { continue };
            let value = mean_over([a, b, c, d], &brightness);
            values[y * width + x] = value * (1.0 - exposure.falloff * (x as f64 / width as f64));
        }
    }
    for _ in 0..exposure.blur {
        values = binomial(&values, width, height);
    }
    GrayImage::from_fn(camera.width, camera.height, |x, y| {
        let value = values[y as usize * width + x as usize] + exposure.noise * random.normal();
        Luma([(value + 0.5).clamp(0.0, 255.0) as u8])
    })
}

/// The mean over a pixel: the brightness of its corners and its centre or, if these differ, the mean of 16 × 16
/// samples.
fn mean_over(corners: [(Point2<f64>, f64); 4], brightness: &dyn Fn(&Point2<f64>) -> f64) -> f64 {
    const SIDE: usize = 16;
    let [a, b, c, d] = corners.map(|(place, _)| place);
    let at = |u: f64, v: f64| {
        let upper = a.coords * (1.0 - u) + b.coords * u;
        let lower = c.coords * (1.0 - u) + d.coords * u;
        Point2::from(upper * (1.0 - v) + lower * v)
    };
    let middle = brightness(&at(0.5, 0.5));
    if corners.iter().all(|(_, brightness)| *brightness == middle) {
        return middle;
    }
    let part = |k: usize| (k as f64 + 0.5) / SIDE as f64;
    let sum: f64 = (0..SIDE * SIDE).map(|k| brightness(&at(part(k % SIDE), part(k / SIDE)))).sum();
    sum / (SIDE * SIDE) as f64
}

fn binomial(values: &[f64], width: usize, height: usize) -> Vec<f64> {
    let rows: Vec<f64> = (0..width * height)
        .map(|k| {
            let (x, row) = (k % width, k - k % width);
            0.25 * (values[row + x.saturating_sub(1)] + 2.0 * values[k] + values[row + (x + 1).min(width - 1)])
        })
        .collect();
    (0..width * height)
        .map(|k| {
            let (x, y) = (k % width, k / width);
            let [above, below] = [y.saturating_sub(1), (y + 1).min(height - 1)].map(|row| rows[row * width + x]);
            0.25 * (above + 2.0 * rows[k] + below)
        })
        .collect()
}
