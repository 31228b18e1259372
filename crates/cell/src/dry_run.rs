//! Plans a grasp from the arm's current posture, with the real sequence and limits, without moving the arm.

use sdg_robot::{
    Arm, ArmState, CameraPose, GraspConfig, GraspStep, HandCommand, HandState, KnownTarget, PlaceGoal, PlacingConfig,
    PlannedAction, PlannedArm, Result, Robot, SafetyLimits, Watch,
};

use crate::sequence_run::run_sequence;

/// A planned grasp that is not executed.
#[derive(Debug)]
pub struct DryRun {
    /// The arm's state at the start.
    pub start: ArmState,
    /// The hand's opening at the start.
    pub opening_m: f64,
    /// The planned motions.
    pub arm: PlannedArm,
    /// The step that cannot be planned, and the reason.
    pub failed: Option<(GraspStep, String)>,
    /// Whether the plan ended at a look-out pose because the part is not visible; see [`crate::Ended::found_nothing`].
    pub found_nothing: bool,
}

impl DryRun {
    /// Plans the sequence from a state of arm and hand. `seen` has the part, if it is visible there, and the others.
    ///
    /// # Errors
    /// A setting of the sequence is invalid, or the place has no room for the part. A motion that violates a limit is
    /// not an error, but is returned in [`Self::failed`].
    pub fn plan(
        start: ArmState,
        hand: HandState,
        mut seen: KnownTarget,
        limits: SafetyLimits,
        camera: CameraPose,
        config: &GraspConfig,
        place: Option<&(PlaceGoal, PlacingConfig)>,
    ) -> Result<Self> {
        let opening_m = hand.opening_m;
        let mut arm = PlannedArm::new(limits.geometry.clone(), start.q_commanded, opening_m).with_hand(hand);
        let mut robot = Robot::new(&mut arm, limits, Watch::default());
        let ended = run_sequence(&mut robot, &mut seen, camera, config, place)?;
        let found_nothing = ended.found_nothing();
        Ok(Self { start, opening_m, arm, failed: ended.failed, found_nothing })
    }

    /// A line for each motion of arm and hand.
    pub fn lines(&self) -> Vec<String> {
        let geometry = self.arm.geometry();
        let in_words = |action: &PlannedAction| match action {
            PlannedAction::Motion(motion) => {
                let tcp = geometry.forward(motion.end()).translation.vector * 1e3;
                let secs = motion.duration_secs();
                Some(format!("tcp to ({:.0}, {:.0}, {:.0}) mm in {secs:.1} s", tcp.x, tcp.y, tcp.z))
            }
            PlannedAction::Wait(_) => None,
            PlannedAction::Down { end, duration_secs } => {
                let z_mm = geometry.forward(end).translation.z * 1e3;
                Some(format!("down softly to about {z_mm:.0} mm, or until contact, in {duration_secs:.1} s"))
            }
            PlannedAction::Hand(HandCommand::Move { opening_m, .. }) => {
                Some(format!("hand open to {:.0} mm", opening_m * 1e3))
            }
            PlannedAction::Hand(HandCommand::Grasp { width_m, force_n, .. }) => {
                Some(format!("hand close on about {:.0} mm with {force_n:.0} N", width_m * 1e3))
            }
        };
        self.arm.actions().iter().filter_map(in_words).collect()
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Isometry3, Point2};
    use sdg_kinematics::{JointVector, ready_pose};
    use sdg_robot::{ArmMode, GraspTarget, LookOut, PartShape, Place, PlaceKind};

    use super::*;

    #[test]
    fn a_part_that_lies_in_the_goal_is_told_by_the_plan() {
        let (q, zero) = (ready_pose(), JointVector::zeros());
        let start =
            ArmState { time_secs: 0.0, q, dq: zero, q_commanded: q, tau_external_nm: zero, mode: ArmMode::Idle };
        let hand = HandState { opening_m: 0.08, is_grasping: false, force_n: None };
        let corners = [[-0.03, -0.01], [0.03, -0.01], [0.03, 0.01], [-0.03, 0.01]].map(Point2::from);
        let bar = PartShape::new(corners, 0.020, 0.030, 0.020).unwrap();
        let config = GraspConfig { look_outs: vec![LookOut::Joints(q)], part: Some(bar), ..GraspConfig::default() };
        let camera = CameraPose::InBase(Isometry3::identity());
        let goal_at = |at_m: [f64; 2], yaw_rad: f64| {
            let place = Place { name: "rack".to_owned(), at_m, yaw_rad, surface_m: 0.0, kind: PlaceKind::Pose };
            place.goal(1).unwrap()
        };
        let lying = |goal: &PlaceGoal| GraspTarget {
            base_from_tcp: goal.base_from_part(0.020, 0.0),
            jaw_width_m: 0.02,
            score: 0.9,
        };
        let (target, goal) = (lying(&goal_at([0.5, 0.1], 0.4)), goal_at([0.4, -0.3], 1.0));
        let planned = |others: Vec<GraspTarget>| {
            let seen = KnownTarget::new(Some(target), camera, &config).with_others(others);
            let place = (goal.clone(), PlacingConfig::default());
            DryRun::plan(start, hand, seen, SafetyLimits::default(), camera, &config, Some(&place)).unwrap().failed
        };
        assert_eq!(planned(Vec::new()), None);
        let (step, why) = planned(vec![lying(&goal)]).unwrap();
        assert_eq!(step, GraspStep::Detect);
        assert!(why.contains("\"rack\" already contains a part, at (0.400, -0.300) m"), "{why}");
    }
}
