//! `~/grasp`: runs the grasp sequence with a ROS 2 arm on a thread.

use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::{Duration, Instant, SystemTime};

use anyhow::{Context, Result};
use sdg_cell::{ModelFinder, MountedCamera, Pictures, TakenPicture, UNKNOWN_HEIGHTS_M, height_measurement, part_shape};
use sdg_grasp::{GraspError, GraspModel};
use sdg_robot::height::GivenHeight;
use sdg_robot::workcell::Workcell;
use sdg_robot::{
    Arm, GraspConfig, GraspOutcome, GraspStep, GraspTarget, KnownTarget, Pace, PartFinder, PlannedArm, Robot,
    RobotError, StepObserver, StopReason, Watch,
};
use sdg_ros2::dds::{TrajectoryArm, network_panic};
use sdg_ros2::messages::{GraspRequest, GraspResponse, Header, PoseStamped, Time};

use crate::camera_pose::CameraPoseReader;
use crate::pictures::Shared;
use crate::requests::given;
use crate::settings::IsInterrupted;

/// Maximum wait for a picture taken after the arm has stopped.
const PICTURE_TIMEOUT: Duration = Duration::from_secs(5);

/// The inputs of a grasp in addition to arm and model.
#[derive(Debug, Clone)]
pub struct GraspInputs {
    /// The workcell, with the limits of motions.
    pub workcell: Workcell,
    /// The camera of the pictures.
    pub camera: MountedCamera,
    /// The given height of the marks, if any.
    pub told: Option<GivenHeight>,
    /// Fraction of the joints' velocity limits, unless a request gives another one.
    pub speed: f64,
    /// The frame of poses in responses.
    pub base_frame: String,
}

/// Pictures of the topic that were taken after the arm has stopped.
#[derive(Clone)]
struct TopicPictures(Arc<Shared>);

impl<A: Arm> Pictures<A> for TopicPictures {
    fn take(&mut self, _arm: &mut A) -> sdg_robot::Result<TakenPicture> {
        let picture = self.0.newer_than(SystemTime::now(), PICTURE_TIMEOUT).ok_or_else(|| {
            let secs = PICTURE_TIMEOUT.as_secs();
            RobotError::Perception(format!("no picture taken after the arm stopped arrived within {secs} s"))
        })?;
        let age = SystemTime::now().duration_since(picture.captured).unwrap_or_default();
        Ok(TakenPicture { picture: (*picture.picture).clone(), taken: Instant::now().checked_sub(age) })
    }
}

/// Records the last step that was begun.
struct LastStep(GraspStep);

impl<A: Arm> StepObserver<A> for LastStep {
    fn before(&mut self, _arm: &mut A, step: GraspStep) -> sdg_robot::Result<()> {
        self.0 = step;
        Ok(())
    }
}

type Ended = (TrajectoryArm, GraspResponse, Option<String>);

/// The arm, and a running grasp.
pub(super) struct Grasping {
    settings: Arc<GraspInputs>,
    pictures: TopicPictures,
    is_interrupted: IsInterrupted,
    arm: Option<TrajectoryArm>,
    running: Option<JoinHandle<Ended>>,
    /// The reason why motions are blocked.
    latched: Option<String>,
}

impl Grasping {
    pub(super) fn new(
        settings: GraspInputs,
        arm: TrajectoryArm,
        pictures: Arc<Shared>,
        is_interrupted: &IsInterrupted,
    ) -> Self {
        Self {
            settings: Arc::new(settings),
            pictures: TopicPictures(pictures),
            is_interrupted: Arc::clone(is_interrupted),
            arm: Some(arm),
            running: None,
            latched: None,
        }
    }

    /// Begins a grasp.
    ///
    /// # Errors
    /// An error if motions are blocked, the speed is invalid, the model has no lengths, the pictures are from another
    /// camera, or the arm is lost.
    pub(super) fn begin(
        &mut self,
        request: &GraspRequest,
        model: &GraspModel,
        camera_pose: &CameraPoseReader,
    ) -> Result<()> {
        if let Some(why) = &self.latched {
            anyhow::bail!("nothing moves until a person has checked the arm and restarts the node: {why}");
        }
        let pace = Pace::at_speed(given("speed", request.speed)?.unwrap_or(self.settings.speed))?;
        if model.facts().lengths.is_none() {
            return Err(GraspError::NoLengths.into());
        }
        camera_pose.check(&self.settings.camera.intrinsics)?;
        let camera = self.settings.camera.with_marks_at(model, self.settings.told.as_ref());
        let config = GraspConfig {
            height: height_measurement(model, &camera, self.settings.told),
            surface_m: camera.assumed_surface_m(),
            pace,
            max_detection_age_secs: 1.0,
            part: part_shape(model),
            ..self.settings.workcell.grasp_config()
        };
        let mut arm = self.arm.take().context("the arm is lost")?;
        arm.forget_reference();
        let settings = Arc::clone(&self.settings);
        let watch = watch(&self.is_interrupted, &self.pictures.0);
        let mut finder = ModelFinder::new(model.clone(), camera, self.pictures.clone());
        if config.height.is_some() {
            finder = finder.with_heights(UNKNOWN_HEIGHTS_M);
        }
        let is_dry_run = request.dry_run;
        self.running = Some(std::thread::spawn(move || {
            let (answer, latched) = if is_dry_run {
                (planned(&settings, &config, &mut arm, &mut finder), None)
            } else {
                grasped(&settings, &config, &mut arm, &mut finder, watch)
            };
            (arm, answer, latched)
        }));
        Ok(())
    }

    /// Whether a grasp is running.
    pub(super) fn is_running(&self) -> bool {
        self.running.as_ref().is_some_and(|running| !running.is_finished())
    }

    /// The result of the grasp; `None` while it is running.
    pub(super) fn finished(&mut self) -> Option<GraspResponse> {
        if self.is_running() {
            return None;
        }
        match self.running.take()?.join() {
            Ok((arm, answer, latched)) => {
                self.arm = Some(arm);
                self.latched = latched;
                Some(answer)
            }
            Err(_) => Some(GraspResponse { message: "the grasp panicked".to_owned(), ..GraspResponse::default() }),
        }
    }
}

fn grasped(
    settings: &GraspInputs,
    config: &GraspConfig,
    arm: &mut TrajectoryArm,
    finder: &mut ModelFinder<TopicPictures>,
    watch: Watch,
) -> (GraspResponse, Option<String>) {
    let mut robot = Robot::new(arm, settings.workcell.safety_limits(), watch);
    let mut step = LastStep(GraspStep::Detect);
    let ended = sdg_robot::grasp(&mut robot, finder, &mut step, settings.camera.pose, config);
    let latched = robot.latched().map(str::to_owned);
    let answer = match ended {
        Ok(report) => {
            let target = report.targets.iter().rev().flatten().next();
            let (success, message) = match &report.outcome {
                GraspOutcome::Held => (true, "the part is held".to_owned()),
                GraspOutcome::Failed { step, why } => (false, format!("{step}: {why}")),
            };
            GraspResponse {
                success,
                message,
                step: step.0.name().to_owned(),
                pose: pose(settings, target),
                closed_width_m: report.closed.map_or(0.0, |hand| hand.opening_m),
            }
        }
        Err(error) => {
            let (step, message) = (step.0.name().to_owned(), error.to_string());
            GraspResponse { message, step, ..GraspResponse::default() }
        }
    };
    (answer, latched)
}

/// A watch that stops the arm when the node must end: at a person's request, or because messages no longer arrive.
fn watch(is_interrupted: &IsInterrupted, pictures: &Arc<Shared>) -> Watch {
    let (is_interrupted, pictures) = (Arc::clone(is_interrupted), Arc::clone(pictures));
    Watch::new(Box::new(move || {
        if is_interrupted() {
            return Some(StopReason::Interrupted);
        }
        let why = pictures.ended.get().map(ToString::to_string);
        why.or_else(|| network_panic().map(|error| error.to_string())).map(StopReason::Watchdog)
    }))
}

/// Plans the grasp without moving, from the arm's current posture.
fn planned(
    settings: &GraspInputs,
    config: &GraspConfig,
    arm: &mut TrajectoryArm,
    finder: &mut ModelFinder<TopicPictures>,
) -> GraspResponse {
    let refused = |message: String| GraspResponse { message, step: "detect".to_owned(), ..GraspResponse::default() };
    let seen =
        arm.state().and_then(|state| Ok((state, arm.hand()?, finder.find_for_plan(arm, settings.told.as_ref())?)));
    let (state, hand, target) = match seen {
        Ok((state, hand, Some(target))) => (state, hand, target),
        Ok(_) => return refused("the part was not found".to_owned()),
        Err(error) => return refused(error.to_string()),
    };
    let mut planned = PlannedArm::new(settings.workcell.robot.geometry(), state.q, hand.opening_m).with_hand(hand);
    let mut robot = Robot::new(&mut planned, settings.workcell.safety_limits(), Default::default());
    let mut step = LastStep(GraspStep::Detect);
    let camera_pose = settings.camera.pose;
    let others = PartFinder::<TrajectoryArm>::others(&*finder);
    let mut known = KnownTarget::new(Some(target), camera_pose, config).with_others(others);
    let ended = sdg_robot::grasp(&mut robot, &mut known, &mut step, camera_pose, config);
    let (success, message) = match ended.map(|report| report.outcome) {
        Ok(GraspOutcome::Held) => (true, "the part can be grasped".to_owned()),
        Ok(GraspOutcome::Failed { step, why }) => (false, format!("{step}: {why}")),
        Err(error) => (false, error.to_string()),
    };
    GraspResponse {
        success,
        message,
        step: step.0.name().to_owned(),
        pose: pose(settings, Some(&target)),
        closed_width_m: target.jaw_width_m,
    }
}

fn pose(settings: &GraspInputs, target: Option<&GraspTarget>) -> PoseStamped {
    let header = Header { stamp: Time::from_system(SystemTime::now()), frame_id: settings.base_frame.clone() };
    let pose = target.map(|target| target.base_from_tcp.into()).unwrap_or_default();
    PoseStamped { header, pose }
}

#[cfg(test)]
mod tests {
    use sdg_ros2::RosError;
    use sdg_ros2::dds::{network_thread, watch_network_threads};

    use super::*;

    #[test]
    fn the_arm_stops_when_messages_no_longer_arrive() {
        let reason = |is_interrupted: bool, pictures: &Arc<Shared>| {
            let is_interrupted: IsInterrupted = Arc::new(move || is_interrupted);
            watch(&is_interrupted, pictures).is_stop_requested()
        };
        let pictures = Arc::new(Shared::new(1));
        assert_eq!(reason(false, &pictures), None);
        assert_eq!(reason(true, &pictures), Some(StopReason::Interrupted));
        let ended = Arc::new(Shared::new(1));
        ended.ended.set(RosError::Network { what: "image".to_owned(), why: "lost".to_owned() }).unwrap();
        assert_eq!(reason(false, &ended), Some(StopReason::Watchdog("image: lost".to_owned())));
        watch_network_threads();
        network_thread("images", || panic!("a test's panic")).unwrap().join().unwrap_err();
        let Some(StopReason::Watchdog(why)) = reason(false, &pictures) else { panic!("no reason to stop") };
        assert!(why.contains("ended by a panic"), "{why}");
    }
}
