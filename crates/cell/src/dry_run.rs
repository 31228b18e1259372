//! A grasp as it would go from where the arm stands: planned with the same sequence and limits; nothing moves.

use sdg_robot::{
    ArmState, CameraPose, GraspConfig, GraspStep, GraspTarget, KnownTarget, PlaceGoal, PlacingConfig, PlannedArm,
    Result, Robot, SafetyLimits, Watch,
};

use crate::sequence_run::{Ended, run_sequence};

/// A grasp that is planned and not carried out.
#[derive(Debug)]
pub struct DryRun {
    /// The arm before it.
    pub start: ArmState,
    /// The hand before it.
    pub opening_m: f64,
    /// What was planned.
    pub arm: PlannedArm,
    /// The step that cannot be planned, and why.
    pub failed: Option<(GraspStep, String)>,
}

impl DryRun {
    /// Plans the sequence from a state of the arm, with the part where it is seen from there, if it is.
    ///
    /// # Errors
    /// A motion that breaks a limit, or a setting that the arm cannot do.
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
