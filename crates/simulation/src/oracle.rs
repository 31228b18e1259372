//! Perception that returns the part's true pose, for measuring the robot without a model.

use nalgebra::{Isometry3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};
use sdg_robot::{GraspTarget, PartFinder, PartShape};

use crate::attempt::{AttemptConfig, AttemptReport};
use crate::error::Result;
use crate::objects::ObjectSpec;
use crate::workcell::Workcell;

/// The grasp at the marks of a part at a pose: x of the tcp along the marks, y across them, z down.
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

/// The part's shape in the format of the grasp sequence.
///
/// # Errors
/// An error for numbers that do not describe a shape.
pub fn part_shape(spec: &ObjectSpec) -> Result<PartShape> {
    let part_from_object = marked_grasp(spec, &Isometry3::identity()).base_from_tcp.inverse();
    let outline = spec.footprint.iter().map(|p| (part_from_object * Point3::new(p.x, p.y, 0.0)).xy());
    // The marks of a round bar are at the height of its axis; the marks of other parts are on top of the part.
    let top_m = spec.mark_height_m.max(2.0 * spec.grasp_height_m);
    Ok(PartShape::new(outline, spec.jaw_width_m, top_m, spec.grasp_height_m)?)
}

/// Perception that returns the part's true pose.
struct Oracle;

impl PartFinder<Workcell> for Oracle {
    fn find(&mut self, cell: &mut Workcell) -> sdg_robot::Result<Option<GraspTarget>> {
        let spec = cell.config().scene.object.as_ref().map(|object| &object.spec);
        Ok(spec.zip(cell.base_from_object()).map(|(spec, pose)| marked_grasp(spec, &pose)))
    }
}

impl Workcell {
    /// Runs one attempt with the part's true pose instead of a detection, as the upper bound for any perception.
    ///
    /// # Errors
    /// As for [`Workcell::run_attempt`].
    pub fn run_oracle_attempt(&mut self, config: &AttemptConfig, seed: u64) -> Result<AttemptReport> {
        self.run_attempt(&mut Oracle, config, seed)
    }
}
