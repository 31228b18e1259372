//! A grasp of a taught part in a workcell: all that is needed besides the arm.

use sdg_grasp::GraspModel;
use sdg_robot::height::GivenHeight;
use sdg_robot::workcell::Workcell;
use sdg_robot::{
    Arm, CompliantArm, GraspConfig, GraspTarget, KnownTarget, Pace, PlaceGoal, PlacingConfig, Result, Robot,
    SafetyLimits, TouchDown,
};

use crate::dry_run::DryRun;
use crate::finder::{ModelFinder, Pictures, UNKNOWN_HEIGHTS_M};
use crate::height::height_measurement;
use crate::mounted_camera::MountedCamera;
use crate::part_shape::part_shape;
use crate::sequence_run::{Ended, run_sequence};

/// Settings of a grasp.
#[derive(Debug, Clone, Copy)]
pub struct GraspSettings {
    /// Speed of the motions.
    pub pace: Pace,
    /// Maximum age of a picture on which a motion is based, in seconds.
    pub max_detection_age_secs: f64,
    /// Whether the last part of the descent is compliant and stops at contact.
    pub is_soft: bool,
    /// The given height of the marks; `None` to measure it.
    pub told: Option<GivenHeight>,
}

/// A grasp, optionally with placing.
#[derive(Debug, Clone)]
pub struct GraspTask {
    /// The workcell.
    pub workcell: Workcell,
    /// The model, which knows lengths.
    pub model: GraspModel,
    /// The camera; see [`MountedCamera::with_marks_at`].
    pub camera: MountedCamera,
    /// Configuration of the sequence.
    pub config: GraspConfig,
    /// The place for the part.
    pub place: Option<(PlaceGoal, PlacingConfig)>,
}

impl GraspTask {
    /// Derives the configuration of the sequence from workcell, model and camera.
    pub fn new(
        workcell: Workcell,
        model: GraspModel,
        camera: MountedCamera,
        goal: Option<PlaceGoal>,
        settings: &GraspSettings,
    ) -> Self {
        let camera = camera.with_marks_at(&model, settings.told.as_ref());
        let config = GraspConfig {
            height: height_measurement(&model, &camera, settings.told),
            surface_m: camera.assumed_surface_m(),
            pace: settings.pace,
            max_detection_age_secs: settings.max_detection_age_secs,
            soft_approach: settings.is_soft.then(TouchDown::default),
            part: part_shape(&model),
            ..workcell.grasp_config()
        };
        let symmetry = model.facts().symmetry;
        let place = goal.map(|goal| (goal, PlacingConfig { symmetry, ..PlacingConfig::default() }));
        Self { workcell, model, camera, config, place }
    }

    /// The given height of the marks, if the camera measures heights.
    pub fn told(&self) -> Option<&GivenHeight> {
        self.config.height.as_ref()?.told.as_ref()
    }

    /// Checks that the place has room for the part and the fingers.
    ///
    /// # Errors
    /// The errors of [`PlaceGoal::check_room`].
    pub fn check_room(&self) -> Result<()> {
        match (&self.place, &self.config.part) {
            (Some((goal, placing)), Some(part)) => {
                let hand = self.workcell.robot.geometry().hand;
                goal.check_room(part, placing.symmetry, placing.release_margin_m, &hand)
            }
            _ => Ok(()),
        }
    }

    /// The finder of the part. If the part is to be placed, the finder ignores parts that lie in a place.
    pub fn finder<P>(&self, pictures: P) -> ModelFinder<P> {
        let mut finder = ModelFinder::new(self.model.clone(), self.camera, pictures);
        if self.config.height.is_some() {
            finder = finder.with_heights(UNKNOWN_HEIGHTS_M);
        }
        if self.place.is_some() {
            finder.places.clone_from(&self.workcell.places);
        }
        finder
    }

    /// Plans the grasp from the arm's current posture; nothing moves. `target` is the part's pose, if it is visible, and
    /// `others` are the other visible parts.
    ///
    /// # Errors
    /// The arm's state cannot be read; the errors of [`DryRun::plan`].
    pub fn plan<A: Arm>(
        &self,
        arm: &mut A,
        limits: SafetyLimits,
        target: Option<GraspTarget>,
        others: Vec<GraspTarget>,
    ) -> Result<DryRun> {
        let (state, hand) = (arm.state()?, arm.hand()?);
        let seen = KnownTarget::new(target, self.camera.pose, &self.config).with_others(others);
        DryRun::plan(state, hand, seen, limits, self.camera.pose, &self.config, self.place.as_ref())
    }

    /// Grasps the part and, if there is a place, puts it there.
    ///
    /// # Errors
    /// The errors of [`run_sequence`].
    pub fn run<A: CompliantArm, P: Pictures<A>>(
        &self,
        robot: &mut Robot<'_, A>,
        finder: &mut ModelFinder<P>,
    ) -> Result<Ended> {
        run_sequence(robot, finder, self.camera.pose, &self.config, self.place.as_ref())
    }
}
