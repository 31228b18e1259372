//! One grasp: the paper's sequence, for every arm.
//!
//! ```text
//! look ─> find ─> hover, turned ─> find ─> above ─> straight down ─> close ─> lift ─> hold
//!          └ detect                 └ detect └────── approach ──┘       └───────┴───────┴ the hand's width and force decide
//! ```
//! Where the height of parts is not told, a camera on the hand takes two pictures on the way down, beside each other (measure.rs).
//!
//! After an empty detection the arm looks from the next place: another place shows a tall part from another side, and shadows of the arm
//! elsewhere. A camera beside the robot looks once, with the arm out of its view.
//!
//! Placing goes on from there: carry ─> come down until the place is felt ─> open, up ─> look where the part lies.

mod carry;
mod config;
mod held_part;
mod hold;
mod look;
mod measure;
mod placing;
mod reach;
mod travel;

use std::time::Instant;

use sdg_kinematics::Trajectory;

use crate::arm::{Arm, CompliantArm};
use crate::arm_state::HandState;
use crate::camera_pose::CameraPose;
use crate::error::{Result, RobotError};
use crate::grasp_target::GraspTarget;
use crate::height::HeightReport;
use crate::lying_part::LyingParts;
use crate::perception::{GraspStep, PartFinder, StepObserver};
use crate::robot::Robot;
use crate::touch::{TouchDown, Touched};

pub use config::{GraspConfig, LOOK_AT_M, LOOK_HEIGHT_M, LookOut, camera_looking_down};
pub use look::{CONFIRMED, SURE};
pub use placing::{PlacingConfig, PlacingOutcome, PlacingReport, grasp_and_place};

use held_part::HeldPart;

/// Least height of the arm over the table on its free motions, m.
pub const FREE_CLEARANCE_M: f64 = 0.05;
/// How long the arm stands still before a picture, s.
const SETTLE_SECS: f64 = 0.25;

/// How a grasp ended.
#[derive(Debug, Clone, PartialEq)]
pub enum GraspOutcome {
    /// The part was lifted, and held to the end.
    Held,
    /// A step failed.
    Failed {
        /// The step that failed.
        step: GraspStep,
        /// Why, in one sentence.
        why: String,
    },
}

/// How a grasp ended, with the targets of each look and the measurements of the hand.
#[derive(Debug, Clone, PartialEq)]
pub struct GraspReport {
    /// How it ended.
    pub outcome: GraspOutcome,
    /// What was found at each look, where it was sure enough.
    pub targets: Vec<Option<GraspTarget>>,
    /// How many looks there were from afar, and how many from above what they found.
    pub looks: [usize; 2],
    /// The hand's state when it had closed.
    pub closed: Option<HandState>,
    /// The verdict of the hand's width and force after closing, lifting and holding: `None` where the part is held, otherwise why not.
    pub hand_verdicts: Vec<(GraspStep, Option<String>)>,
    /// What was touched on soft ways down, in their order.
    pub touched: Vec<Touched>,
    /// How high the part lies, where that was to be measured.
    pub height: Option<HeightReport>,
}

/// Grasps the part once.
///
/// # Errors
/// What ended the sequence other than a grasp that failed: perception that could not work, and everything after which nothing
/// moves until a person says so, but for a part that held the arm up, which is a failed grasp.
pub fn grasp<A: Arm>(
    robot: &mut Robot<'_, A>,
    finder: &mut dyn PartFinder<A>,
    observer: &mut dyn StepObserver<A>,
    camera: CameraPose,
    config: &GraspConfig,
) -> Result<GraspReport> {
    let mut sequence = Sequence::new(robot, finder, observer, camera, config);
    let outcome = sequence.grasp(|_, _| Ok(()))?;
    Ok(sequence.grasp_report(outcome))
}

/// As [`grasp`], with an arm that yields: it comes down as [`GraspConfig::soft_approach`] says.
///
/// # Errors
/// As [`grasp`].
pub fn grasp_softly<A: CompliantArm>(
    robot: &mut Robot<'_, A>,
    finder: &mut dyn PartFinder<A>,
    observer: &mut dyn StepObserver<A>,
    camera: CameraPose,
    config: &GraspConfig,
) -> Result<GraspReport> {
    let mut sequence = Sequence::yielding(robot, finder, observer, camera, config);
    let outcome = sequence.grasp(|_, _| Ok(()))?;
    Ok(sequence.grasp_report(outcome))
}

/// Comes down until something is felt.
type Touch<A> = fn(&mut Robot<'_, A>, &TouchDown) -> Result<Touched>;

/// Why the sequence ended early.
enum Stop {
    Failed(GraspStep, String),
    Error(RobotError),
}

impl From<RobotError> for Stop {
    fn from(error: RobotError) -> Self {
        Self::Error(error)
    }
}

type Steps<T> = std::result::Result<T, Stop>;

/// What is wrong with one grasp is a failure of its step; what is wrong with the robot ends everything.
fn fails_at<T>(step: GraspStep, result: Result<T>) -> Steps<T> {
    result.map_err(|error| match error {
        RobotError::Planning(error) => Stop::Failed(step, error.to_string()),
        error @ (RobotError::Unsafe(_) | RobotError::Blocked(_) | RobotError::NoWay(_)) => {
            Stop::Failed(step, error.to_string())
        }
        error => Stop::Error(error),
    })
}

struct Sequence<'s, 'r, A: Arm> {
    robot: &'s mut Robot<'r, A>,
    finder: &'s mut dyn PartFinder<A>,
    observer: &'s mut dyn StepObserver<A>,
    cell: Cell<'s, A>,
    known: Known,
    /// What is reported in the end, but for the outcome.
    report: GraspReport,
}

/// What stays as it is during a sequence.
struct Cell<'s, A: Arm> {
    camera: CameraPose,
    config: &'s GraspConfig,
    /// Of an arm that yields.
    touch: Option<Touch<A>>,
}

/// What is known at a moment of the attempt.
struct Known {
    /// When the picture was taken that the next motion rests on.
    picture_time: Option<Instant>,
    /// The hand when it had closed.
    closed: Option<HandState>,
    held: Option<HeldPart>,
    /// z of what the part lies on as measured, m.
    surface_m: Option<f64>,
    /// Parts that lie and are not to be touched.
    lying: LyingParts,
    /// How far the hand is open, or is to be on the next straight way, m.
    opening_m: f64,
    /// How far the hand opens beyond the part, both sides together, m.
    opening_margin_m: f64,
}

impl GraspReport {
    /// Of an attempt of which nothing was done yet.
    fn begun() -> Self {
        Self {
            outcome: GraspOutcome::Failed { step: GraspStep::Detect, why: "nothing was done".to_owned() },
            targets: Vec::new(),
            looks: [0; 2],
            closed: None,
            hand_verdicts: Vec::new(),
            touched: Vec::new(),
            height: None,
        }
    }
}

impl GraspOutcome {
    /// Whether the part was held to the end.
    pub fn is_held(&self) -> bool {
        *self == Self::Held
    }
}

impl<'s, 'r, A: Arm> Sequence<'s, 'r, A> {
    fn new(
        robot: &'s mut Robot<'r, A>,
        finder: &'s mut dyn PartFinder<A>,
        observer: &'s mut dyn StepObserver<A>,
        camera: CameraPose,
        config: &'s GraspConfig,
    ) -> Self {
        let known = Known {
            picture_time: None,
            closed: None,
            held: None,
            surface_m: None,
            lying: LyingParts::new(&config.lying),
            opening_m: robot.geometry().hand.opening_max_m,
            opening_margin_m: config.opening_margin_m,
        };
        let cell = Cell { camera, config, touch: None };
        Self { robot, finder, observer, cell, known, report: GraspReport::begun() }
    }

    /// Comes down softly until something is felt, where the arm yields; `None` where it does not.
    fn touch_down(&mut self, touch_down: &TouchDown, step: GraspStep) -> Steps<Option<Touched>> {
        let Some(touch) = self.cell.touch else { return Ok(None) };
        let touched = fails_at(step, touch(self.robot, touch_down))?;
        self.report.touched.push(touched);
        Ok(Some(touched))
    }

    /// Grasps what `is_wanted` does not refuse once it was found; how that ended.
    fn grasp(&mut self, is_wanted: impl FnOnce(&mut Self, &GraspTarget) -> Steps<()>) -> Result<GraspOutcome> {
        match self.run(is_wanted) {
            Ok(()) => Ok(GraspOutcome::Held),
            Err(Stop::Failed(step, why)) => Ok(GraspOutcome::Failed { step, why }),
            Err(Stop::Error(error)) => Err(error),
        }
    }

    fn grasp_report(&mut self, outcome: GraspOutcome) -> GraspReport {
        GraspReport { outcome, closed: self.known.closed, ..std::mem::replace(&mut self.report, GraspReport::begun()) }
    }

    fn run(&mut self, is_wanted: impl FnOnce(&mut Self, &GraspTarget) -> Steps<()>) -> Steps<()> {
        let first = self.look_around()?;
        let target = match self.cell.camera {
            CameraPose::OnFlange(_) => {
                let seen = self.look_from_above(&first)?;
                self.measure_height(&seen)?
            }
            CameraPose::InBase(_) => first,
        };
        is_wanted(self, &target)?;
        self.take(&target)
    }

    /// From above a part that was found to the part in the air.
    fn take(&mut self, target: &GraspTarget) -> Steps<()> {
        self.known.lying.take(&target.base_from_tcp);
        let approach = self.go_above(target)?;
        self.descend(approach)?;
        self.close(target)?;
        self.lift()?;
        self.hold()
    }

    /// z of what the part lies on, m: as measured, or else the table's as told.
    fn surface_height_m(&self) -> f64 {
        self.known.surface_m.unwrap_or(self.robot.limits().table_height_m)
    }

    /// Tells the observer that a step is done; its word is a failure of the step.
    fn passed(&mut self, step: GraspStep) -> Steps<()> {
        match self.observer.after(self.robot.arm(), step)? {
            None => Ok(()),
            Some(why) => Err(Stop::Failed(step, why)),
        }
    }

    fn follow(&mut self, motion: Trajectory, step: GraspStep) -> Steps<()> {
        fails_at(step, self.robot.follow(motion))
    }
}

impl<'s, 'r, A: CompliantArm> Sequence<'s, 'r, A> {
    /// As [`Sequence::new`], with an arm that yields.
    fn yielding(
        robot: &'s mut Robot<'r, A>,
        finder: &'s mut dyn PartFinder<A>,
        observer: &'s mut dyn StepObserver<A>,
        camera: CameraPose,
        config: &'s GraspConfig,
    ) -> Self {
        let touch: Touch<A> = |robot, touch_down| robot.touch_down(touch_down);
        let mut sequence = Self::new(robot, finder, observer, camera, config);
        sequence.cell.touch = Some(touch);
        sequence
    }
}
