//! Runs a grasp, optionally with placing, in one call.

use sdg_robot::{
    CameraPose, CompliantArm, GraspConfig, GraspOutcome, GraspReport, GraspStep, PartFinder, PlaceGoal, PlaceOffset,
    PlacingConfig, PlacingOutcome, Robot, Touched, grasp_and_place, grasp_softly,
};

/// The result of a sequence.
pub struct Ended {
    /// The grasp.
    pub grasp: GraspReport,
    /// The step that failed, and the reason; `None` if all steps succeeded.
    pub failed: Option<(GraspStep, String)>,
    /// Offset of the placed part from its place, measured in the last picture; `None` without a place or a measurement,
    /// and if a repeated grasp began after that picture.
    pub beside: Option<PlaceOffset>,
    /// The results of the compliant descents of placing and of repeated grasps.
    pub touched: Vec<Touched>,
}

impl Ended {
    /// As [`GraspReport::found_nothing`].
    pub fn found_nothing(&self) -> bool {
        self.grasp.found_nothing()
    }
}

/// Grasps the part and, if a place is given, puts it there.
///
/// # Errors
/// The errors of [`sdg_robot::grasp`] or, with a place, of [`sdg_robot::grasp_and_place`].
pub fn run_sequence<A: CompliantArm>(
    robot: &mut Robot<'_, A>,
    finder: &mut dyn PartFinder<A>,
    camera: CameraPose,
    config: &GraspConfig,
    place: Option<&(PlaceGoal, PlacingConfig)>,
) -> sdg_robot::Result<Ended> {
    let Some((goal, placing)) = place else {
        let grasp = grasp_softly(robot, finder, &mut (), camera, config)?;
        let failed = match &grasp.outcome {
            GraspOutcome::Held => None,
            GraspOutcome::Failed { step, why } => Some((*step, why.clone())),
        };
        return Ok(Ended { grasp, failed, beside: None, touched: Vec::new() });
    };
    let report = grasp_and_place(robot, finder, &mut (), camera, config, goal, placing)?;
    let failed = match report.outcome {
        PlacingOutcome::Placed => None,
        PlacingOutcome::Failed { step, why } => Some((step, why)),
    };
    Ok(Ended { grasp: report.grasp, failed, beside: report.last, touched: report.touched })
}
