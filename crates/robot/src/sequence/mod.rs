//! One grasp: the paper's sequence, for every arm.
//!
//! ```text
//! look ─> find ─> hover, turned ─> find ─> above ─> straight down ─> close ─> lift ─> hold
//!          └ detect                 └ detect └────── approach ──┘       └───────┴───────┴ the hand's width and force decide
//! ```
//! After an empty detection the arm looks from the next place: another place shows a tall part from another side, and shadows of the arm
//! elsewhere. A camera beside the robot looks once, with the arm out of its view.

mod config;
mod hold;
mod look;
mod reach;

use std::time::Instant;

use sdg_kinematics::Trajectory;

use crate::arm::Arm;
use crate::arm_state::HandState;
use crate::error::{Result, RobotError};
use crate::perception::{GraspStep, GraspTarget, PartFinder, StepObserver};
use crate::robot::Robot;

pub use config::{CameraMount, GraspConfig, LOOK_AT_M, LOOK_HEIGHT_M, LookOut, camera_looking_down};
pub use look::SURE;

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
    mount: CameraMount,
    config: &GraspConfig,
) -> Result<GraspReport> {
    let mut sequence = Sequence {
        robot,
        finder,
        observer,
        mount,
        config,
        targets: Vec::new(),
        looks: [0; 2],
        picture_time: None,
        closed: None,
        hand_verdicts: Vec::new(),
    };
    let outcome = match sequence.run() {
        Ok(()) => GraspOutcome::Held,
        Err(Stop::Failed(step, why)) => GraspOutcome::Failed { step, why },
        Err(Stop::Error(error)) => return Err(error),
    };
    let Sequence { targets, looks, closed, hand_verdicts, .. } = sequence;
    Ok(GraspReport { outcome, targets, looks, closed, hand_verdicts })
}

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
        error @ (RobotError::Unsafe(_) | RobotError::Blocked(_)) => Stop::Failed(step, error.to_string()),
        error => Stop::Error(error),
    })
}

struct Sequence<'s, 'r, A: Arm> {
    robot: &'s mut Robot<'r, A>,
    finder: &'s mut dyn PartFinder<A>,
    observer: &'s mut dyn StepObserver<A>,
    mount: CameraMount,
    config: &'s GraspConfig,
    targets: Vec<Option<GraspTarget>>,
    looks: [usize; 2],
    /// When the picture was taken that the next motion rests on.
    picture_time: Option<Instant>,
    closed: Option<HandState>,
    hand_verdicts: Vec<(GraspStep, Option<String>)>,
}

impl GraspOutcome {
    /// Whether the part was held to the end.
    pub fn is_held(&self) -> bool {
        *self == Self::Held
    }
}

impl<A: Arm> Sequence<'_, '_, A> {
    fn run(&mut self) -> Steps<()> {
        let first = self.look_around()?;
        let target = match self.mount {
            CameraMount::Hand { .. } => self.look_from_above(&first)?,
            CameraMount::Base => first,
        };
        let approach = self.go_above(&target)?;
        self.descend(approach)?;
        self.close(&target)?;
        self.lift()?;
        self.hold()
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
