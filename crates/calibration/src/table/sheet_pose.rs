//! The camera's pose above the sheet, and its errors.

use nalgebra::{Isometry3, Vector3};
use sdg_geometry::PinholeCamera;

use crate::board::Board;
use crate::detection::SeenCorner;
use crate::error::CalibrationError;
use crate::pose::board_pose;

/// The pose of a camera above a sheet.
#[derive(Debug, Clone, PartialEq)]
pub struct SheetPose {
    /// Transform from the optical frame to the sheet's frame (origin and axes as in [`Board`], z up from the sheet), in
    /// metres.
    pub sheet_from_camera: Isometry3<f64>,
    /// Root of the mean squared distance between corners and their projections, in pixels.
    pub rms_px: f64,
    /// Standard error of the camera's height above the sheet, in metres, from the corners alone: the intrinsics count
    /// as exact.
    pub sigma_height_m: f64,
    /// Standard error of the tilt about a horizontal axis, in radians.
    pub sigma_tilt_rad: f64,
    /// The angle between the optical axis and the vertical, in radians.
    pub tilt_rad: f64,
}

/// Largest angle from the vertical, in degrees. Beyond this angle, the horizon is near, and lengths on the table along
/// the line of sight appear shortened to about a quarter or less.
const MAX_TILT_DEG: f64 = 75.0;

/// Finds the camera's pose above the sheet.
///
/// # Errors
/// [`CalibrationError::NoPose`], [`CalibrationError::Horizon`].
pub fn locate_sheet(
    camera: &PinholeCamera,
    board: &Board,
    corners: &[SeenCorner],
) -> Result<SheetPose, CalibrationError> {
    let pose = board_pose(camera, board, corners).ok_or(CalibrationError::NoPose)?;
    let camera_from_sheet = pose.camera_from_board;
    let normal: Vector3<f64> = camera_from_sheet.rotation * Vector3::z();
    // The sheet's z points to the camera, that is, along -z of the optical frame.
    let tilt_rad = (-normal.z).clamp(-1.0, 1.0).acos();
    if tilt_rad.to_degrees() > MAX_TILT_DEG {
        return Err(CalibrationError::Horizon { tilt_deg: tilt_rad.to_degrees(), max_deg: MAX_TILT_DEG });
    }
    // A twist (v, ω) moves the camera's position in the sheet's frame by -Rᵀ v.
    let of_place = pose.covariance.fixed_view::<3, 3>(0, 0);
    let sigma_height_m = (normal.transpose() * of_place * normal)[0].max(0.0).sqrt();
    let of_turn = pose.covariance.fixed_view::<3, 3>(3, 3);
    let horizontal = [Vector3::x(), Vector3::y()].map(|axis| {
        let axis = camera_from_sheet.rotation * axis;
        (axis.transpose() * of_turn * axis)[0].max(0.0)
    });
    let sigma_tilt_rad = (0.5 * (horizontal[0] + horizontal[1])).sqrt();
    let sheet_from_camera = camera_from_sheet.inverse();
    Ok(SheetPose { sheet_from_camera, rms_px: pose.rms_px, sigma_height_m, sigma_tilt_rad, tilt_rad })
}
