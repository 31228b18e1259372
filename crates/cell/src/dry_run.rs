//! Plans a grasp from the arm's current posture, with the real sequence and limits, without moving the arm.

use sdg_robot::{
    Arm, ArmState, CameraPose, GraspConfig, GraspStep, GraspTarget, HandCommand, HandState, KnownTarget, PlaceGoal,
    PlacingConfig, PlannedAction, PlannedArm, Result, Robot, SafetyLimits, Watch,
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
    /// Plans the sequence from a state of arm and hand. `target` is the part's pose, if the part is visible there.
    ///
    /// # Errors
    /// A setting of the sequence is invalid, or the place has no room for the part. A motion that violates a limit is
    /// not an error, but is returned in [`Self::failed`].
    pub fn plan(
        start: ArmState,
        hand: HandState,
        target: Option<GraspTarget>,
        limits: SafetyLimits,
        camera: CameraPose,
        config: &GraspConfig,
        place: Option<&(PlaceGoal, PlacingConfig)>,
    ) -> Result<Self> {
        let opening_m = hand.opening_m;
        let mut arm = PlannedArm::new(limits.geometry.clone(), start.q_commanded, opening_m).with_hand(hand);
        let mut robot = Robot::new(&mut arm, limits, Watch::default());
        let mut finder = KnownTarget::new(target, camera, config);
        let ended = run_sequence(&mut robot, &mut finder, camera, config, place)?;
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
