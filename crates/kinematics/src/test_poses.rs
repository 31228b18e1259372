//! Poses and configurations that the tests of several files use.

use std::f64::consts::PI;

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use rand::Rng;
use rand_pcg::Pcg64Mcg;

use crate::joints::JointVector;
use crate::limits::JointLimits;

/// A random configuration within Franka's joint ranges.
pub fn random_configuration(rng: &mut Pcg64Mcg) -> JointVector {
    let limits = JointLimits::panda();
    JointVector::from_fn(|i, _| rng.random_range(limits.position_min[i]..limits.position_max[i]))
}

/// The hand points vertically down, rotated by `yaw_rad` about the vertical.
pub fn top_grasp(x: f64, y: f64, z: f64, yaw_rad: f64) -> Isometry3<f64> {
    Isometry3::from_parts(
        Translation3::new(x, y, z),
        UnitQuaternion::from_axis_angle(&Vector3::z_axis(), yaw_rad)
            * UnitQuaternion::from_axis_angle(&Vector3::x_axis(), PI),
    )
}
