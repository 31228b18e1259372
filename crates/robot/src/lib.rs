//! One grasp sequence for every arm, and the limits between each motion and the arm.
#![forbid(unsafe_code)]
#![cfg_attr(test, allow(clippy::unwrap_used))]

mod arm;
mod error;
mod pace;
mod perception;
mod playback;
mod robot;
mod safety;
mod sequence;
mod watch;

pub use arm::{
    Arm, ArmMode, ArmState, ContactSensitivity, GRASP_TOLERANCE_M, HandCommand, HandState, Load, MIN_HELD_WIDTH_M,
    MotionEnd, PERIOD_SECS,
};
pub use error::{Result, RobotError};
pub use pace::{DEFAULT_SPEED, MAX_SPEED, Pace};
pub use perception::{GraspStep, GraspTarget, PartFinder, StepObserver};
pub use playback::{JointReference, Playback, STOP_SECS};
pub use robot::Robot;
pub use safety::{Capsule, CheckedMotion, LinkCapsules, SafetyLimits, SelfCollision, Violation, WorkspaceBox};
pub use sequence::{
    CameraMount, FREE_CLEARANCE_M, GraspConfig, GraspOutcome, GraspReport, LOOK_AT_M, LOOK_HEIGHT_M, LookOut,
    camera_looking_down, grasp,
};
pub use watch::{HISTORY_SECS, MAX_SILENCE_SECS, StopReason, StopRequest, Watch};
