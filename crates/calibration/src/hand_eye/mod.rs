//! The camera's pose on the robot's hand or beside the robot, from robot poses and pictures of the board.
//!
//! Legend, with one equation for both mounts, for picture `i`: `camera_from_board_i = X⁻¹ A_i Y`.
//!
//! | | camera on the hand | camera beside the robot |
//! |---|---|---|
//! | `X` | `flange_from_camera` | `base_from_camera` |
//! | `A_i` | `flange_from_base`, the inverse of the robot's pose | `base_from_flange`, the robot's pose |
//! | `Y` | `base_from_board` | `flange_from_board` |
//!
//! ```text
//! boards' poses ─ A_ij X = X B_ij in closed form ─ reprojection over all pictures minimised in X and Y   closed_form.rs, bundle.rs
//!               ─ inaccurate robot poses: their errors estimated with X and Y ─ one left out at a time
//! poses that contradict the pictures ─ another reading of all, a few wrong ones, the board's size     diagnosis.rs, readings.rs, mixed_up.rs
//! ```
//! A robot's pose has an error far above that of the corners: 0.05 degrees at 0.5 m are 0.4 mm, about half a pixel at a
//! focal length of 600 px. If the reprojection error is larger than the errors of the corners explain, each robot pose
//! gets six corrections, whose squares are weighted relative to the squared pixels.

mod bundle;
mod closed_form;
mod diagnosis;
mod euler;
mod mixed_up;
mod poses_file;
mod readings;
mod solve;
mod view;

use nalgebra::Isometry3;
use sdg_geometry::{Mount, PinholeCamera};

pub use self::poses_file::{RobotPose, read_robot_poses};
use self::solve::{Evidence, ROBOT_SIGMA};
pub use self::view::{HandEyeView, MIN_POSES};
use crate::board::Board;
use crate::camera_file::{CalibratedCamera, Frame, TablePose};
use crate::error::CalibrationError;
use crate::pose::{BoardPose, board_pose};

/// Result of the hand-eye calibration.
#[derive(Debug, Clone, PartialEq)]
pub struct HandEye {
    /// `flange_from_camera` or `base_from_camera`, in metres.
    pub frame_from_camera: Isometry3<f64>,
    /// `base_from_board` or `flange_from_board`, in metres.
    pub frame_from_board: Isometry3<f64>,
    /// Root of the expected squared distance of the camera from its true position, metres.
    pub sigma_m: f64,
    /// Root of the expected squared angular error, radians.
    pub sigma_rad: f64,
    /// Root of the mean squared distance of corners, with the given robot poses.
    pub rms_px: f64,
    /// Root of the mean squared distance of corners if each picture has its own pose: the error of corners and
    /// intrinsics alone.
    pub board_rms_px: f64,
    /// The estimated errors of the robot's poses, if measurable: in metres and radians, along and about each axis. The
    /// ratio of the two is assumed.
    pub robot_sigma: Option<[f64; 2]>,
    /// RMS error of each picture with the given robot pose, in the given order.
    pub pictures_rms_px: Vec<f64>,
    /// Change of the camera's pose when a picture is left out: metres and radians, for each picture in the given order.
    pub spread: Vec<[f64; 2]>,
}

impl HandEye {
    /// The largest changes in [`Self::spread`]: metres and radians.
    pub fn max_spread(&self) -> [f64; 2] {
        [0, 1].map(|k| self.spread.iter().map(|spread| spread[k]).fold(0.0, f64::max))
    }

    /// The camera with its pose, on the hand or above the table. `table_height_m` is the table's z in the base frame,
    /// used for [`Mount::Base`]. `None` keeps the height in `camera` if its `table` is in the base frame; otherwise the
    /// height is 0.
    pub fn mounted(&self, camera: CalibratedCamera, mount: Mount, table_height_m: Option<f64>) -> CalibratedCamera {
        match mount {
            Mount::Hand => CalibratedCamera { flange_from_camera: Some(self.frame_from_camera), ..camera },
            Mount::Base => {
                let old = camera.table.as_ref().filter(|table| table.frame == Frame::Base);
                let table = TablePose {
                    frame: Frame::Base,
                    height_m: table_height_m.or(old.map(|table| table.height_m)).unwrap_or_default(),
                    frame_from_camera: self.frame_from_camera,
                    workspace: old.and_then(|table| table.workspace),
                };
                CalibratedCamera { table: Some(table), ..camera }
            }
        }
    }
}

/// Finds the pose of the camera on the hand or beside the robot.
///
/// # Units and frames
/// Pixels with the first centre at (0.5, 0.5); metres; frames as in the module's legend.
///
/// # Errors
/// [`CalibrationError::TooFewPictures`], [`CalibrationError::TurnsAlike`], [`CalibrationError::HandEyeDisagrees`],
/// [`CalibrationError::WrongPoses`], [`CalibrationError::OtherBoardScale`], [`CalibrationError::NoPose`].
pub fn calibrate_hand_eye(
    camera: &PinholeCamera,
    board: &Board,
    mount: Mount,
    views: &[HandEyeView],
) -> Result<HandEye, CalibrationError> {
    if views.len() < MIN_POSES {
        return Err(CalibrationError::TooFewPictures { least: MIN_POSES, found: views.len(), hint: "" });
    }
    let poses: Option<Vec<BoardPose>> = views.iter().map(|view| board_pose(camera, board, &view.corners)).collect();
    let poses = poses.ok_or(CalibrationError::NoPose)?;
    let robot: Vec<_> = views.iter().map(|view| view.base_from_flange).collect();
    let evidence = Evidence { camera, board, mount, views: views.iter().collect(), poses: poses.iter().collect() };
    let solved = diagnosis::checked(&evidence, &robot)?;
    let (found, without) = (&solved.minimum.at, solved.without_each());
    let covariance = solved.minimum.information.try_inverse().ok_or(CalibrationError::NoPose)? * solved.variance();
    let sigma = |from: usize| (from..from + 3).map(|k| covariance[(k, k)].max(0.0)).sum::<f64>().sqrt();
    let spread = without.iter().map(|other| {
        let moved = (other.translation.vector - found.x.translation.vector).norm();
        [moved, other.rotation.angle_to(&found.x.rotation)]
    });
    Ok(HandEye {
        frame_from_camera: found.x,
        frame_from_board: found.y,
        sigma_m: sigma(0),
        sigma_rad: sigma(3),
        rms_px: found.rms_px(),
        board_rms_px: solved.board_rms_px,
        robot_sigma: solved.robot_scale.map(|scale| ROBOT_SIGMA.map(|sigma| scale * sigma)),
        pictures_rms_px: found.rms_of_pictures(),
        spread: spread.collect(),
    })
}
