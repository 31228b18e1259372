//! `~/grasp`: the grasp sequence with an arm behind ROS 2, in a thread.

use std::path::PathBuf;
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::{Duration, Instant, SystemTime};

use anyhow::{Context, Result};
use sdg_cell::{ModelFinder, Pictures, PlacedCamera, TakenPicture, UNKNOWN_HEIGHTS_M, height_measurement, part_shape};
use sdg_grasp::{GraspError, GraspModel};
use sdg_robot::height::ToldHeight;
use sdg_robot::workcell::Workcell;
use sdg_robot::{
    Arm, GraspConfig, GraspOutcome, GraspStep, GraspTarget, KnownTarget, PartFinder, PlannedArm, Robot, RobotError,
    StepObserver,
};
use sdg_ros2::dds::TrajectoryArm;
use sdg_ros2::messages::{GraspRequest, GraspResponse, Header, PoseStamped, Time};

use super::pictures::Shared;
use crate::camera_files;
use crate::commands::ros2::args::Ros2Args;
use crate::exit::Usage;
use crate::interrupt::Interrupt;
use crate::robots;

/// How long a picture that was taken after the arm stopped is waited for.
const PATIENCE: Duration = Duration::from_secs(5);

/// What a grasp needs besides an arm and a model.
pub(crate) struct GraspSettings {
    workcell: Workcell,
    camera: PlacedCamera,
    told: Option<ToldHeight>,
    speed: f64,
    base_frame: String,
}

impl GraspSettings {
    /// Reads and checks the workcell and the camera.
    ///
    /// # Errors
    /// Files that cannot be used.
    pub(crate) fn read(args: &Ros2Args) -> Result<Self> {
        let workcell_path: &PathBuf =
            args.arm.workcell.as_ref().ok_or_else(|| Usage("--allow-motion: expected --workcell FILE".to_owned()))?;
        let (workcell, camera_of_workcell) = robots::read_workcell(workcell_path)?;
        robots::pace(args.arm.speed)?;
        let camera_path = args
            .camera
            .clone()
            .or(camera_of_workcell)
            .ok_or_else(|| Usage("--allow-motion: expected --camera FILE".to_owned()))?;
        let (calibrated, _) = camera_files::read(&camera_path)?;
        let camera = camera_files::placed(&calibrated, &workcell, &camera_path)?;
        let base_frame = args.base_frame.clone().unwrap_or_else(|| "panda_link0".to_owned());
        let told = args.arm.height.told(workcell.table_height_m);
        Ok(Self { workcell, camera, told, speed: args.arm.speed, base_frame })
    }
}

/// The newest picture of the topic, once the arm is at rest.
#[derive(Clone)]
struct TopicPictures(Arc<Shared>);

impl<A: Arm> Pictures<A> for TopicPictures {
    fn take(&mut self, _arm: &mut A) -> sdg_robot::Result<TakenPicture> {
        let picture = self.0.newer_than(SystemTime::now(), PATIENCE).ok_or_else(|| {
            let secs = PATIENCE.as_secs();
            RobotError::Perception(format!("no picture for {secs} s that was taken after the arm stopped"))
        })?;
        let age = SystemTime::now().duration_since(picture.captured).unwrap_or_default();
        Ok(TakenPicture { picture: (*picture.picture).clone(), taken: Instant::now().checked_sub(age) })
    }
}

/// Remembers the last step that was begun.
struct LastStep(GraspStep);

impl<A: Arm> StepObserver<A> for LastStep {
    fn before(&mut self, _arm: &mut A, step: GraspStep) -> sdg_robot::Result<()> {
        self.0 = step;
        Ok(())
    }
}

type Ended = (TrajectoryArm, GraspResponse, Option<String>);

/// The arm, and a grasp under way.
pub(super) struct Grasping {
    settings: Arc<GraspSettings>,
    pictures: TopicPictures,
    interrupt: Interrupt,
    arm: Option<TrajectoryArm>,
    running: Option<JoinHandle<Ended>>,
    /// Why nothing moves any more.
    latched: Option<String>,
}

impl Grasping {
    pub(super) fn new(
        settings: GraspSettings,
        arm: TrajectoryArm,
        pictures: Arc<Shared>,
        interrupt: &Interrupt,
    ) -> Self {
        Self {
            settings: Arc::new(settings),
            pictures: TopicPictures(pictures),
            interrupt: interrupt.clone(),
            arm: Some(arm),
            running: None,
            latched: None,
        }
    }

    /// Begins a grasp.
    ///
    /// # Errors
    /// A speed that is none, a model without lengths, and an arm that stopped before.
    pub(super) fn begin(&mut self, request: &GraspRequest, model: &GraspModel) -> Result<()> {
        if let Some(why) = &self.latched {
            anyhow::bail!("nothing moves until a person has looked and starts the node again: {why}");
        }
        let speed = if request.speed > 0.0 { request.speed } else { self.settings.speed };
        let pace = robots::pace(speed)?;
        if model.facts().lengths.is_none() {
            return Err(GraspError::NoLengths.into());
        }
        let camera = self.settings.camera.with_marks_at(model, self.settings.told.as_ref());
        let config = GraspConfig {
            height: height_measurement(model, &camera, self.settings.told),
            pace,
            max_detection_age_secs: 1.0,
            part: part_shape(model),
            ..self.settings.workcell.grasp_config()
        };
        let mut arm = self.arm.take().context("the arm is lost")?;
        let (settings, interrupt) = (Arc::clone(&self.settings), self.interrupt.clone());
        let mut finder = ModelFinder::new(model.clone(), camera, self.pictures.clone());
        if config.height.is_some() {
            finder = finder.with_heights(UNKNOWN_HEIGHTS_M);
        }
        let is_dry_run = request.dry_run;
        self.running = Some(std::thread::spawn(move || {
            let (answer, latched) = if is_dry_run {
                (planned(&settings, &config, &mut arm, &mut finder), None)
            } else {
                grasped(&settings, &config, &mut arm, &mut finder, &interrupt)
            };
            (arm, answer, latched)
        }));
        Ok(())
    }

    /// What became of the grasp; `None` while it goes on.
    pub(super) fn finished(&mut self) -> Option<GraspResponse> {
        if !self.running.as_ref().is_some_and(JoinHandle::is_finished) {
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
    settings: &GraspSettings,
    config: &GraspConfig,
    arm: &mut TrajectoryArm,
    finder: &mut ModelFinder<TopicPictures>,
    interrupt: &Interrupt,
) -> (GraspResponse, Option<String>) {
    let mut robot = Robot::new(arm, settings.workcell.safety_limits(), robots::watch(interrupt));
    let mut step = LastStep(GraspStep::Detect);
    let ended = sdg_robot::grasp(&mut robot, finder, &mut step, settings.camera.mount(), config);
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

/// The same with an arm that moves nothing, from where the real one stands.
fn planned(
    settings: &GraspSettings,
    config: &GraspConfig,
    arm: &mut TrajectoryArm,
    finder: &mut ModelFinder<TopicPictures>,
) -> GraspResponse {
    let refused = |message: String| GraspResponse { message, step: "detect".to_owned(), ..GraspResponse::default() };
    let seen = arm.state().and_then(|state| Ok((state, arm.hand()?, finder.find(arm)?)));
    let (state, hand, target) = match seen {
        Ok((state, hand, Some(target))) if target.score >= sdg_robot::SURE => (state, hand, target),
        Ok(_) => return refused("the part was not found".to_owned()),
        Err(error) => return refused(error.to_string()),
    };
    let mut planned = PlannedArm::new(state.q, hand.opening_m);
    let mut robot = Robot::new(&mut planned, settings.workcell.safety_limits(), Default::default());
    let mut step = LastStep(GraspStep::Detect);
    let mount = settings.camera.mount();
    let mut known = KnownTarget::new(Some(target), mount, config);
    let ended = sdg_robot::grasp(&mut robot, &mut known, &mut step, mount, config);
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

fn pose(settings: &GraspSettings, target: Option<&GraspTarget>) -> PoseStamped {
    let header = Header { stamp: Time::from_system(SystemTime::now()), frame_id: settings.base_frame.clone() };
    let pose = target.map(|target| target.base_from_tcp.into()).unwrap_or_default();
    PoseStamped { header, pose }
}
