//! Frames fixed to the flange.

use nalgebra::Isometry3;

use super::plant::{Jacobian, JointVector, Plant};

/// Pose and Jacobian of an end effector on the flange.
pub fn end_effector_at(
    plant: &dyn Plant,
    flange_from_ee: &Isometry3<f64>,
    q: &JointVector,
) -> (Isometry3<f64>, Jacobian) {
    let (flange, jacobian) = plant.flange(q);
    (flange * flange_from_ee, shifted(&jacobian, &flange, flange_from_ee))
}

/// The Jacobian of a point fixed to the flange.
pub fn shifted(
    flange_jacobian: &Jacobian,
    base_from_flange: &Isometry3<f64>,
    flange_from_point: &Isometry3<f64>,
) -> Jacobian {
    let lever = base_from_flange.rotation * flange_from_point.translation.vector;
    let mut jacobian = *flange_jacobian;
    for joint in 0..7 {
        let angular = flange_jacobian.fixed_view::<3, 1>(3, joint).into_owned();
        let linear = flange_jacobian.fixed_view::<3, 1>(0, joint) + angular.cross(&lever);
        jacobian.fixed_view_mut::<3, 1>(0, joint).copy_from(&linear);
    }
    jacobian
}
