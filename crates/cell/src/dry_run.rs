//! Plans a grasp from the arm's current posture, with the real sequence and limits, without moving the arm.

use sdg_robot::{
    ArmState, CameraPose, GraspConfig, GraspStep, GraspTarget, KnownTarget, PlaceGoal, PlacingConfig, PlannedArm,
    Result, Robot, SafetyLimits, Watch,
};

use crate::sequence_run::{Ended, run_sequence};

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
}

impl DryRun {
    /// Plans the sequence from a state of the arm. `target` is the part's pose, if the part is visible in this state.
    ///
    /// # Errors
    /// A setting of the sequence is invalid, or the place has no room for the part. A motion that violates a limit is
    /// not an error, but is returned in [`Self::failed`].
    pub fn plan(
        start: ArmState,
        opening_m: f64,
        target: Option<GraspTarget>,
        limits: SafetyLimits,
        camera: CameraPose,
        config: &GraspConfig,
        place: Option<&(PlaceGoal, PlacingConfig)>,
    ) -> Result<Self> {
        let mut arm = PlannedArm::new(limits.geometry.clone(), start.q_commanded, opening_m);
        let mut robot = Robot::new(&mut arm, limits, Watch::default());
        let mut finder = KnownTarget::new(target, camera, config);
        let Ended { failed, .. } = run_sequence(&mut robot, &mut finder, camera, config, place)?;
        Ok(Self { start, opening_m, arm, failed })
    }
}
