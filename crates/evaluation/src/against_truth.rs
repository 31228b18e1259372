//! A grasp found in a picture against the simulator's truth: where it leads the hand, and the error of place and angle.
//!
//! Rehearsals, tried pictures and evaluations all measure by this.

use nalgebra::Isometry3;
use sdg_geometry::{PlanarGrasp, PosedCamera};
use sdg_grasp::{GraspError, GraspPlane, GraspPose};
use sdg_report::DetectionError;
use sdg_simulation::objects::{LARGEST_JAW_WIDTH_M, ObjectSpec};

/// Where a grasp in a camera's picture leads the hand: through the camera onto the surface that it shows at the marks, whose
/// height no photo tells.
///
/// # Errors
/// A ray that misses that height, or a part wider than the hand opens.
pub fn grasp_pose(object: &ObjectSpec, camera: &PosedCamera, grasp: &PlanarGrasp) -> Result<GraspPose, GraspError> {
    let plane = GraspPlane { mark_height_m: object.seen_height_m, grasp_height_m: object.grasp_height_m };
    GraspPose::from_planar(camera, grasp, &plane, LARGEST_JAW_WIDTH_M)
}

/// How far a grasp lies beside the true one, as reports give it; turns that the part's symmetry hides do not count.
pub fn grasp_error(
    object: &ObjectSpec,
    base_from_object: &Isometry3<f64>,
    base_from_tcp: &Isometry3<f64>,
) -> DetectionError {
    let error = object.grasp_error(base_from_object, base_from_tcp);
    DetectionError { distance_mm: error.distance_m * 1e3, angle_deg: error.angle_rad.to_degrees() }
}
