//! Cameras and the poses of their boards, for the comparison with OpenCV.

use image::GrayImage;
use nalgebra::Isometry3;
use sdg_calibration::Board;
use sdg_geometry::{PinholeCamera, PlumbBob};

use super::{Exposure, Random, camera_from_board, render};

/// A webcam of 1280×720 pixels with some distortion.
pub const WEBCAM: PinholeCamera = PinholeCamera {
    width: 1280,
    height: 720,
    fx: 980.0,
    fy: 978.0,
    cx: 652.0,
    cy: 351.0,
    lens: PlumbBob { k1: 0.08, k2: -0.17, p1: -0.001, p2: 0.0006, k3: 0.0 },
};

/// A wide-angle lens with few pixels, a webcam, and a telephoto lens with many pixels.
pub const CAMERAS: [(&str, PinholeCamera); 3] = [
    (
        "wide",
        PinholeCamera {
            width: 640,
            height: 480,
            fx: 450.0,
            fy: 451.5,
            cx: 327.0,
            cy: 234.0,
            lens: PlumbBob { k1: -0.31, k2: 0.12, p1: 0.0012, p2: -0.0008, k3: 0.0 },
        },
    ),
    ("webcam", WEBCAM),
    (
        "long",
        PinholeCamera {
            width: 1280,
            height: 960,
            fx: 1900.0,
            fy: 1900.0,
            cx: 640.0,
            cy: 480.0,
            lens: PlumbBob { k1: -0.12, k2: 0.3, p1: 0.0, p2: 0.0004, k3: 0.0 },
        },
    ),
];

/// Number of pictures of each camera.
pub const NUM_PICTURES: usize = 15;

/// The board of the comparison.
pub fn board() -> Board {
    Board::new(9, 6, 0.025).expect("a board")
}

/// The board's pose in each picture: completely visible, at positions all over the picture, tilted by up to 40 degrees
/// about the picture's x and y.
pub fn poses(camera: &PinholeCamera) -> Vec<Isometry3<f64>> {
    let board = board();
    let (width, height) = (f64::from(camera.width), f64::from(camera.height));
    let mut random = Random(17);
    let pose = |k: usize| {
        let [column, row] = [(k % 3) as f64 - 1.0, (k / 3 % 3) as f64 - 1.0];
        loop {
            let distance = random.within(1.0, 1.7) * 0.24 * camera.fx / width;
            let pixel = [
                width * (0.5 + 0.25 * column + random.within(-0.04, 0.04)),
                height * (0.5 + 0.22 * row + random.within(-0.04, 0.04)),
            ];
            let tilts = [random.within(-0.36, 0.36), random.within(-0.36, 0.36), random.within(-0.3, 0.3)];
            let pose = camera_from_board(&board, camera, pixel, distance, tilts);
            // The board's outer corners, not the white margin around the board, must be visible.
            let rim = [[0, 0], [0, board.rows()], [board.columns(), 0], [board.columns(), board.rows()]];
            let is_whole = rim.iter().all(|corner| {
                camera.project(&(pose * board.corner(*corner))).is_some_and(|pixel| {
                    (6.0..width - 6.0).contains(&pixel.x) && (6.0..height - 6.0).contains(&pixel.y)
                })
            });
            if is_whole {
                return pose;
            }
        }
    };
    (0..NUM_PICTURES).map(pose).collect()
}

/// The pictures.
pub fn pictures(camera: &PinholeCamera) -> Vec<GrayImage> {
    let mut random = Random(29);
    poses(camera).iter().map(|pose| render(&board(), camera, pose, &Exposure::ORDINARY, &mut random)).collect()
}
