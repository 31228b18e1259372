//! Perception that gives the part's true pose, to measure the robot without a model.

use nalgebra::{Isometry3, Rotation3, Translation3, UnitQuaternion, Vector3};
use sdg_robot::GraspTarget;

use crate::attempt::{AttemptConfig, AttemptReport};
use crate::error::Result;
use crate::objects::ObjectSpec;
use crate::workcell::Workcell;

/// The grasp that a part's marks ask for, with the part at a pose: x of the tcp along the marks, y
/// across them, z down.
pub fn marked_grasp(spec: &ObjectSpec, base_from_object: &Isometry3<f64>) -> GraspTarget {
    let (point, direction_rad) = spec.grasp_in_base(base_from_object);
    let down = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
    let turn = UnitQuaternion::from_rotation_matrix(&Rotation3::from_axis_angle(&Vector3::z_axis(), direction_rad));
    GraspTarget {
        base_from_tcp: Isometry3::from_parts(Translation3::from(point), turn * down),
        jaw_width_m: spec.jaw_width_m,
        score: 1.0,
    }
}

impl Workcell {
    /// Tries once with the part's true pose instead of a picture's: the upper bound of what any
    /// perception can reach.
    ///
    /// # Errors
    /// Errors of the simulation.
    pub fn run_oracle_attempt(&mut self, config: &AttemptConfig, seed: u64) -> Result<AttemptReport> {
        let spec = self.config().scene.object.as_ref().map(|object| object.spec.clone());
        self.run_attempt_with(
            &mut |cell, _| Ok(spec.as_ref().zip(cell.base_from_object()).map(|(spec, pose)| marked_grasp(spec, &pose))),
            config,
            seed,
        )
    }
}
