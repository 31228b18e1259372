//! Perception for a planned arm: the part has the same known pose for every pose of the arm.

use nalgebra::{Isometry3, Point3};

use crate::Arm;
use crate::camera_pose::CameraPose;
use crate::error::Result;
use crate::grasp_target::GraspTarget;
use crate::height::{MeasuredHeight, Sighting};
use crate::perception::PartFinder;
use crate::planned_arm::PlannedArm;
use crate::sequence::GraspConfig;

/// Assumed accuracy of positions, in m, and of sizes, as a fraction.
const EXACT: f64 = 1e-4;

/// Finds the same target, or none, and the same other parts for any pose of the arm. After the part was put down, finds
/// it at its intended pose.
#[derive(Debug, Clone)]
pub struct KnownTarget {
    target: Option<GraspTarget>,
    others: Vec<GraspTarget>,
    camera: CameraPose,
    /// Distance of the grasp below the marks, m.
    marks_over_grasp_m: f64,
}

impl KnownTarget {
    /// A known target without other parts, for a sequence with this camera and configuration.
    pub fn new(target: Option<GraspTarget>, camera: CameraPose, config: &GraspConfig) -> Self {
        let marks_over_grasp_m = config.height.map_or(0.0, |height| height.marks_over_grasp_m());
        Self { target, others: Vec::new(), camera, marks_over_grasp_m }
    }

    /// Sets the other parts that are seen beside the target.
    #[must_use]
    pub fn with_others(self, others: Vec<GraspTarget>) -> Self {
        Self { others, ..self }
    }
}

impl PartFinder<PlannedArm> for KnownTarget {
    fn find(&mut self, _arm: &mut PlannedArm) -> Result<Option<GraspTarget>> {
        Ok(self.target)
    }

    /// Returns the intended pose: a part that was put down is assumed to lie there.
    fn find_nearest(&mut self, _arm: &mut PlannedArm, base_from_tcp: &Isometry3<f64>) -> Result<Option<GraspTarget>> {
        Ok(self.target.map(|target| GraspTarget { base_from_tcp: *base_from_tcp, ..target }))
    }

    fn sight(&mut self, arm: &mut PlannedArm, _expected: &GraspTarget) -> Result<Vec<Sighting>> {
        let Some(tcp_from_camera) = self.camera.tcp_from_camera(arm.geometry()) else { return Ok(Vec::new()) };
        let q = arm.state()?.q;
        let base_from_camera = arm.geometry().forward(&q) * tcp_from_camera;
        let sighting = |target: GraspTarget| {
            let p = target.base_from_tcp.translation;
            Sighting {
                camera_m: base_from_camera.translation.vector.into(),
                middle_m: Point3::new(p.x, p.y, p.z + self.marks_over_grasp_m),
                place_sigma_m: EXACT,
                size: Some(1.0),
                size_sigma: EXACT,
                target,
            }
        };
        Ok(self.target.map(sighting).into_iter().collect())
    }

    fn surface_beside(&mut self, _pair: &[Sighting; 2], expected: &MeasuredHeight) -> Result<Option<MeasuredHeight>> {
        Ok(Some(MeasuredHeight { sigma_m: EXACT, ..*expected }))
    }

    fn others(&self) -> Vec<GraspTarget> {
        self.others.clone()
    }
}
