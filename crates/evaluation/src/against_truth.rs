//! Compares a detected grasp with the simulator's ground truth: the pose for the hand, and the errors of position and
//! angle.
//!
//! Trials and evaluations on axes score detections with [`grasp_pose`]. Rehearsals and evaluations of cameras compare
//! the pose that perception returns; this pose does not depend on the object's known height.

use nalgebra::Isometry3;
use sdg_geometry::{PlanarGrasp, PosedCamera};
use sdg_grasp::{GraspError, GraspPlane, GraspPose};
use sdg_report::DetectionError;
use sdg_simulation::objects::{LARGEST_JAW_WIDTH_M, ObjectSpec};

/// The hand's pose for a grasp in a camera's picture. The grasp is projected onto the surface with the marks. The
/// surface's height comes from the object, because a photo does not show it.
///
/// # Errors
/// The ray through the grasp does not meet that surface, or the part is wider than the hand opens.
pub fn grasp_pose(object: &ObjectSpec, camera: &PosedCamera, grasp: &PlanarGrasp) -> Result<GraspPose, GraspError> {
    let plane = GraspPlane { mark_height_m: object.seen_height_m, grasp_height_m: object.grasp_height_m };
    GraspPose::from_planar(camera, grasp, &plane, LARGEST_JAW_WIDTH_M)
}

/// Error of a grasp relative to the true one, modulo the part's symmetry.
pub fn grasp_error(
    object: &ObjectSpec,
    base_from_object: &Isometry3<f64>,
    base_from_tcp: &Isometry3<f64>,
) -> DetectionError {
    let error = object.grasp_error(base_from_object, base_from_tcp);
    DetectionError { distance_mm: error.distance_m * 1e3, angle_deg: error.angle_rad.to_degrees() }
}
