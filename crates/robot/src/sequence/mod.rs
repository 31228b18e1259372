//! One grasp by the sequence of the paper *SingleDemoGrasp*, for every arm.
//!
//! ```text
//! look ─> find ─> hover, rotated ─> find ─> above ─> straight down ─> close ─> lift ─> hold
//!          └ detect                 └ detect └────── approach ──┘       └───────┴───────┴ the hand's width and force decide
//! ```
//! With [`GraspConfig::height`], a camera on the hand also takes pictures from adjacent positions before the approach
//! (measure.rs).
//!
//! Without a detection, the next picture is taken from the next look-out pose: this picture shows a tall part from
//! another side, and the arm's shadows fall elsewhere. A camera beside the robot takes pictures only while the arm is
//! in a look-out pose, outside the camera's view.
//!
//! Placing continues the sequence: carry ─> descend until contact with the place ─> open, up ─> measure with a picture
//! where the part lies.

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

use nalgebra::Point3;
use sdg_kinematics::Trajectory;

use crate::arm::{Arm, CompliantArm};
use crate::arm_state::{HandState, Load};
use crate::camera_pose::CameraPose;
use crate::error::{Result, RobotError};
use crate::grasp_target::GraspTarget;
use crate::height::HeightReport;
use crate::lying_part::LyingParts;
use crate::perception::{GraspStep, PartFinder, StepObserver};
use crate::robot::Robot;
use crate::touch::{TouchDown, Touched};

pub use config::{GraspConfig, LOOK_AT_M, LOOK_HEIGHT_M, LookOut, camera_looking_down};
pub use look::{MIN_CONFIRMING_SCORE, SURE};
pub use placing::{PlacingConfig, PlacingOutcome, PlacingReport, grasp_and_place};

use held_part::HeldPart;

/// Minimum height of the arm above the table during free motions, m; less if the destination is lower, or if the start
/// is lower and there are obstacles in the cell.
pub const FREE_CLEARANCE_M: f64 = 0.05;
/// Time that the arm stands still before a picture, s.
const SETTLE_SECS: f64 = 0.25;

/// The outcome of a grasp.
#[derive(Debug, Clone, PartialEq)]
pub enum GraspOutcome {
    /// The part was lifted and held to the end.
    Held,
    /// A step failed.
    Failed {
        /// The failed step.
        step: GraspStep,
        /// The reason, in one sentence.
        why: String,
    },
}

/// The outcome of a grasp, with the target of each picture and the measurements of the hand.
#[derive(Debug, Clone, PartialEq)]
pub struct GraspReport {
    /// The outcome.
    pub outcome: GraspOutcome,
    /// The accepted detection of each picture that `looks` counts, `None` without one; after them the target at the
    /// part's height, if this height was determined.
    pub targets: Vec<Option<GraspTarget>>,
    /// Numbers of pictures: from look-out poses, and from above the first detection.
    pub looks: [usize; 2],
    /// The hand's state after it closed.
    pub closed: Option<HandState>,
    /// The verdict of the hand's width and force after closing, lifting and holding: `None` if the part is held,
    /// otherwise the reason.
    pub hand_verdicts: Vec<(GraspStep, Option<String>)>,
    /// The results of the compliant descents, in order.
    pub touched: Vec<Touched>,
    /// The part's height, if it was to be measured.
    pub height: Option<HeightReport>,
}

/// Grasps the part once. A hand that holds an object at the beginning is a failed grasp, and nothing moves.
///
/// # Errors
/// A failure of perception, an unreachable first look-out pose, and every error that stops the arm or loses the
/// connection. A motion that cannot be planned, violates a limit or is blocked by an obstacle is not an error but a
/// failed grasp.
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

/// As [`grasp`], with a compliant arm, which descends as [`GraspConfig::soft_approach`] describes if that is given.
///
/// # Errors
/// As for [`grasp`].
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

/// Descends until a contact.
type Touch<A> = fn(&mut Robot<'_, A>, &TouchDown) -> Result<Touched>;

/// The reason why the sequence ended early.
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

/// A motion that cannot be planned, violates a limit or is blocked fails the step; other errors end the sequence.
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
    /// The final report except the outcome.
    report: GraspReport,
}

/// The constant data of a sequence.
struct Cell<'s, A: Arm> {
    camera: CameraPose,
    config: &'s GraspConfig,
    /// The compliant descent; `None` for an arm that is not used as a compliant one.
    touch: Option<Touch<A>>,
}

/// The state of the attempt.
struct Known {
    /// The time of the picture on which the next motion depends.
    picture_time: Option<Instant>,
    /// State of the hand after it closed.
    closed: Option<HandState>,
    held: Option<HeldPart>,
    /// z of the surface under the part, from the measured or given height of the part, m.
    surface_m: Option<f64>,
    /// Point on the surface under the present grasp or place, base frame, m.
    support: Option<Point3<f64>>,
    /// Lying parts that must not be touched.
    lying: LyingParts,
    /// The present opening of the hand, or that of the next straight path, m.
    opening_m: f64,
    /// Opening of the hand beyond the part's width, both sides together, m.
    opening_margin_m: f64,
}

impl GraspReport {
    /// The state of an attempt before its first step.
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

    /// Whether a picture was taken and did not contain the part. If the first motion was rejected, no picture was
    /// taken.
    pub fn found_nothing(&self) -> bool {
        let is_look = matches!(self.outcome, GraspOutcome::Failed { step: GraspStep::Detect, .. });
        is_look && self.targets.last() == Some(&None)
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
            surface_m: config.surface_m,
            support: None,
            lying: LyingParts::new(&config.lying),
            opening_m: robot.geometry().hand.opening_max_m,
            opening_margin_m: config.opening_margin_m,
        };
        let cell = Cell { camera, config, touch: None };
        Self { robot, finder, observer, cell, known, report: GraspReport::begun() }
    }

    /// Descends compliantly until a contact; `None` if the arm is not compliant.
    fn touch_down(&mut self, touch_down: &TouchDown, step: GraspStep) -> Steps<Option<Touched>> {
        let Some(touch) = self.cell.touch else { return Ok(None) };
        let touched = fails_at(step, touch(self.robot, touch_down))?;
        self.report.touched.push(touched);
        Ok(Some(touched))
    }

    /// Grasps the part unless `is_wanted` refuses the detection; returns the outcome.
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
        self.check_hand()?;
        self.reset_load()?;
        let first = self.look_around()?;
        let target = match self.cell.camera {
            CameraPose::OnFlange(_) => {
                let seen = self.look_from_above(&first)?;
                self.measure_height(&seen)?
            }
            CameraPose::InBase(_) => first,
        };
        self.check_target(&target)?;
        is_wanted(self, &target)?;
        self.take(&target, self.surface_height_m())
    }

    /// Fails if the hand holds an object: the sequence opens the hand in the air, and the object would fall.
    fn check_hand(&mut self) -> Steps<()> {
        if self.robot.hand()?.is_grasping {
            let why = "the hand still holds an object: open it first".to_owned();
            return Err(Stop::Failed(GraspStep::Detect, why));
        }
        Ok(())
    }

    /// Resets the load of the empty hand: an earlier program may have ended before it did so.
    fn reset_load(&mut self) -> Steps<()> {
        // An arm that may not move may refuse the load, without the reason why it may not move.
        self.robot.ready()?;
        Ok(self.robot.set_load(Load::NONE)?)
    }

    /// Moves above a found part, grasps it, lifts it and holds it. `support_m` is z of the surface under the part, from
    /// which the obstacle with this surface is recognised, m.
    fn take(&mut self, target: &GraspTarget, support_m: f64) -> Steps<()> {
        self.known.lying.take(&target.base_from_tcp);
        let p = target.base_from_tcp.translation;
        self.known.support = Some(Point3::new(p.x, p.y, support_m));
        let approach = self.go_above(target)?;
        self.descend(approach)?;
        self.close(target)?;
        self.lift()?;
        self.hold()
    }

    /// z of the surface under the part, m: from the part's height if that is known, otherwise the table's height.
    fn surface_height_m(&self) -> f64 {
        self.known.surface_m.unwrap_or(self.robot.limits().table_height_m)
    }

    /// Reports to the observer that a step begins.
    fn begin(&mut self, step: GraspStep) -> Steps<()> {
        Ok(self.observer.before(self.robot.arm(), step)?)
    }

    /// Reports a finished step to the observer, which may fail the step with a reason.
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
    /// As [`Sequence::new`], with a compliant arm.
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
