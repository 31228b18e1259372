//! The pose of a camera that is tilted about the point at which it is aimed.

use nalgebra::{Isometry3, Translation3, Unit, UnitQuaternion, Vector3};
use sdg_robot::camera_looking_down;

/// The pose of a camera at a distance (m) from the point `aim` of the table, tilted from straight down about a
/// horizontal axis through this point. `axis_rad` is the axis' direction about z from x, in the base frame, and
/// `yaw_rad` is the camera's yaw before it is tilted.
pub(super) fn tilted_camera(
    aim: &Vector3<f64>,
    distance_m: f64,
    yaw_rad: f64,
    axis_rad: f64,
    tilt_deg: f64,
) -> Isometry3<f64> {
    let axis = Unit::new_normalize(Vector3::new(axis_rad.cos(), axis_rad.sin(), 0.0));
    let tilted = UnitQuaternion::from_axis_angle(&axis, tilt_deg.to_radians());
    let about_aim = Translation3::from(*aim) * tilted * Translation3::from(-*aim);
    about_aim * camera_looking_down(aim.x, aim.y, distance_m, yaw_rad)
}
