//! Pictures from above with an arm that does not move.

use nalgebra::UnitQuaternion;
use sdg_kinematics::{ArmGeometry, ready_pose};

use super::*;
use crate::camera_pose::CameraPose;
use crate::perception::PartFinder;
use crate::planned_arm::PlannedArm;
use crate::robot::Robot;
use crate::safety::SafetyLimits;
use crate::sequence::{GraspConfig, GraspOutcome, grasp};
use crate::watch::Watch;

/// Shows two parts. The second one is the best in every picture except the first.
struct Two {
    parts: [GraspTarget; 2],
    num_pictures: usize,
    shows_first: bool,
}

impl PartFinder<PlannedArm> for Two {
    fn find(&mut self, _arm: &mut PlannedArm) -> crate::Result<Option<GraspTarget>> {
        self.num_pictures += 1;
        Ok(Some(self.parts[usize::from(self.num_pictures > 1)]))
    }

    fn find_nearest(&mut self, _arm: &mut PlannedArm, at: &Isometry3<f64>) -> crate::Result<Option<GraspTarget>> {
        self.num_pictures += 1;
        let apart_m = |part: &GraspTarget| (part.base_from_tcp.translation.vector - at.translation.vector).norm();
        let shown = &self.parts[usize::from(!self.shows_first)..];
        Ok(shown.iter().copied().min_by(|a, b| apart_m(a).total_cmp(&apart_m(b))))
    }
}

fn part(x_m: f64) -> GraspTarget {
    let down = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
    let base_from_tcp = Isometry3::from_parts(Vector3::new(x_m, 0.05, 0.01).into(), down);
    GraspTarget { base_from_tcp, jaw_width_m: 0.02, score: 0.9 }
}

/// The outcome and the last target with a second part at this distance from the first one, and the number of pictures.
fn grasped(beside_m: f64, shows_first: bool) -> (GraspOutcome, Option<GraspTarget>, usize) {
    let tcp_from_camera = Isometry3::translation(0.072, 0.0, -0.0534);
    let camera = CameraPose::OnFlange(ArmGeometry::panda().flange_from_tcp() * tcp_from_camera);
    let mut arm = PlannedArm::new(ArmGeometry::panda(), ready_pose(), 0.08);
    let mut robot = Robot::new(&mut arm, SafetyLimits::default(), Watch::default());
    let mut finder = Two { parts: [part(0.5), part(0.5 + beside_m)], num_pictures: 0, shows_first };
    let report = grasp(&mut robot, &mut finder, &mut (), camera, &GraspConfig::default()).unwrap();
    (report.outcome, report.targets.last().copied().flatten(), finder.num_pictures)
}

#[test]
fn the_picture_from_above_is_of_the_part_below_the_camera() {
    for beside_m in [0.025, 0.1] {
        assert_eq!(grasped(beside_m, true), (GraspOutcome::Held, Some(part(0.5)), 3));
    }
    // The only part is where a detection from afar may be wrong.
    assert_eq!(grasped(0.025, false), (GraspOutcome::Held, Some(part(0.5 + 0.025)), 3));
    // Farther away, it is another part.
    let (outcome, target, num_pictures) = grasped(0.1, false);
    let GraspOutcome::Failed { step: GraspStep::Detect, why } = outcome else { panic!("{outcome:?}") };
    assert_eq!((why.as_str(), target, num_pictures), ("the part was not found in 3 looks from above it", None, 7));
}
