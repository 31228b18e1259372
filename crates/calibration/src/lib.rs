//! Calibration of cameras and their files.
//!
//! ```text
//! Board ─ Sheet (SVG, PDF) ─ printed, photographed ─ find_board: corners to 0.03 px, each with its position on the board
//!   ├─ PictureTaker        a camera's frames        ─ selection of frames as pictures
//!   ├─ BoardSession        a camera's frames        ─ pictures until nothing is missing, and the view needed next
//!   ├─ calibrate           many pictures            ─ focal length, centre, lens, with errors and advice
//!   ├─ locate_sheet        one, on the table        ─ the camera's pose above the table
//!   └─ calibrate_hand_eye  many, with robot poses   ─ the camera's pose on the robot's hand, or beside the robot
//! CalibratedCamera: ROS's camera_info YAML, with `table:` and `hand_eye:` ─ PosedCamera, workspace ─ plan view
//! ```
//! **Frames.** ROS and OpenCV place the first pixel's centre at (0, 0), this project at (0.5, 0.5): half a pixel is
//! added when a camera file is read and subtracted when the file is written. The board's origin is the outer corner of
//! its lower left dark square, x right, y up, z out of the sheet. Lengths are in metres; `z` points up from the table.
//!
//! **Not supported**: fisheye lenses, several cameras at once, rolling shutters. Not in this crate: access to files
//! (crates `inputs` and `cli`) and clocks.
//!
//! ```
//! use nalgebra::{Isometry3, Vector3};
//! use sdg_calibration::{Board, SeenCorner, locate_sheet};
//! use sdg_geometry::PinholeCamera;
//!
//! // A camera 0.5 m above the sheet's origin, looking vertically down.
//! let board = Board::new(9, 6, 0.025)?;
//! let camera_from_sheet = Isometry3::new(Vector3::new(0.0, 0.0, 0.5), Vector3::x() * std::f64::consts::PI);
//! let seen = board.corners().map(|corner| {
//!     let p_in_camera = camera_from_sheet * board.corner(corner);
//!     SeenCorner { corner, pixel: PinholeCamera::WRIST.project(&p_in_camera).expect("in front of the camera") }
//! });
//! let sheet = locate_sheet(&PinholeCamera::WRIST, &board, &seen.collect::<Vec<_>>())?;
//! assert!((sheet.sheet_from_camera.translation.z - 0.5).abs() < 1e-9);
//! # Ok::<(), sdg_calibration::CalibrationError>(())
//! ```
#![forbid(unsafe_code)]
#![cfg_attr(test, allow(clippy::unwrap_used))]

mod board;
mod board_session;
mod camera_file;
mod camera_sections;
mod detection;
mod error;
mod guessed;
mod hand_eye;
mod homography;
mod intrinsics;
mod least_squares;
mod pose;
mod projection;
mod records;
mod table;
mod taking;

pub use board::{Board, Paper, Sheet};
pub use board_session::{BoardSession, BoardSight};
pub use camera_file::{CalibratedCamera, Frame, TablePose};
pub use detection::{MIN_CORNERS, SeenCorner, find_board};
pub use error::{CalibrationError, CameraFileError};
pub use guessed::{ASSUMED_VIEW_DEG, FocalSource, UNCALIBRATED, bent_px, guess_camera};
pub use hand_eye::{HandEye, HandEyeView, MIN_POSES, RobotPose, calibrate_hand_eye, read_robot_poses};
pub use intrinsics::{Advice, Calibration, CalibrationConfig, MIN_PICTURES, PictureFit, calibrate};
pub use pose::{BoardPose, board_pose};
pub use records::pose_json;
pub use table::{
    FocalCost, FocalEstimate, SheetPlacement, SheetPose, focal_cost, focal_from_sheet, homography_rms_px, locate_sheet,
};
pub use taking::{PictureTaker, Sight};
