//! Calibrated cameras: where they are and what their lenses do, as files.
//!
//! ```text
//! camera_info YAML of ROS ─┐
//!                          ├─ CalibratedCamera ─ PosedCamera, table, workspace ─ plan view
//! `table:` beside it ──────┘
//! ```
//! **Frames.** ROS and OpenCV put the first pixel's centre at (0, 0), this project at (0.5, 0.5): half a pixel is added when
//! such a file is read and taken away when it is written. Lengths in metres, `z` up from the table.
#![forbid(unsafe_code)]
#![cfg_attr(test, allow(clippy::unwrap_used))]

mod board;
mod camera_file;
mod detection;
mod error;
mod homography;
mod intrinsics;
mod least_squares;
mod pose;
mod projection;
mod table;

pub use board::{Board, Paper, Sheet};
pub use camera_file::{CalibratedCamera, Frame, TablePose};
pub use detection::{MIN_CORNERS, SeenCorner, find_board};
pub use error::{CalibrationError, CameraFileError};
pub use intrinsics::{Advice, Calibration, CalibrationConfig, MIN_PICTURES, PictureFit, calibrate};
pub use pose::{BoardPose, board_pose};
pub use table::{FocalCost, FocalEstimate, SheetPose, focal_cost, focal_from_sheet, homography_rms_px, locate_sheet};
