//! The sequence of grasping and placing for every arm, and the limits against which each motion is checked.
//!
//! ```text
//! workcell file ─► SafetyLimits, GraspConfig
//! PartFinder ─► GraspTarget ─► grasp: plan ─► Robot::follow ─► SafetyLimits::check ─► CheckedMotion ─► Arm::follow
//!                                                                                     Watch ◄─ ArmState ─┘
//! ```
//! [`Arm`] is implemented by [`FrankaArm`], by [`PlannedArm`] for dry runs, and in the crates `simulation` and `ros2`.
//! A motion reaches an arm only as a [`CheckedMotion`], except a compliant descent, whose path is checked before it
//! starts. After an error during a motion nothing moves until [`Robot::recover`].
//!
//! [`grasp_and_place`] continues to a [`PlaceGoal`]; [`Robot::plan_around`] finds paths around the obstacles of the
//! cell.
//!
//! This crate has no cameras and no detection (the caller passes a [`PartFinder`]), no files and no terminal.
//!
//! ```
//! use sdg_kinematics::{JointLimits, Trajectory, ready_pose};
//! use sdg_robot::{SafetyLimits, Violation};
//!
//! let mut folded = ready_pose();
//! (folded[1], folded[3], folded[5]) = (-1.7, -3.0, 0.5);
//! let slow = JointLimits::panda().scaled(0.1, 0.1, 0.1)?;
//! let motion = Trajectory::point_to_point(&ready_pose(), &folded, &slow)?;
//! let refused = SafetyLimits::default().check(motion);
//! assert!(matches!(refused, Err(Violation::SelfCollision { .. })), "{refused:?}");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
#![forbid(unsafe_code)]
#![cfg_attr(test, allow(clippy::unwrap_used))]

mod arm;
mod arm_state;
mod camera_pose;
mod error;
mod franka;
mod grasp_target;
pub mod height;
mod impedance;
mod known_target;
mod lying_part;
mod pace;
mod part_shape;
mod perception;
mod place;
mod planned_arm;
mod playback;
mod robot;
mod robot_address;
mod room;
mod safety;
mod sequence;
mod surroundings;
mod touch;
mod watch;
pub mod workcell;

pub use arm::{Arm, CompliantArm};
pub use arm_state::{
    ArmMode, ArmState, ContactSensitivity, GRASP_TOLERANCE_M, HandCommand, HandState, Load, MAX_WIDTH_CHANGE_M,
    MIN_HELD_WIDTH_M, MotionEnd, PERIOD_SECS, held_widths_m,
};
pub use camera_pose::CameraPose;
pub use error::{Result, RobotError};
pub use franka::{FrankaArm, Scheduling, check_real_time};
pub use grasp_target::GraspTarget;
pub use impedance::{Impedance, ImpedanceControl, TcpReference};
pub use known_target::KnownTarget;
pub use lying_part::LyingPart;
pub use pace::{DEFAULT_SPEED, MAX_SPEED, Pace};
pub use part_shape::PartShape;
pub use perception::{GraspStep, PartFinder, StepObserver};
pub use place::{Place, PlaceGoal, PlaceKind, PlaceOffset, TrayCell};
pub use planned_arm::{PlannedAction, PlannedArm};
pub use playback::{JointReference, Playback, STOP_SECS};
pub use robot::Robot;
pub use robot_address::RobotAddress;
pub use safety::{CheckedMotion, SafetyLimits, SelfCollision, Violation, WorkspaceBox};
pub use sdg_kinematics::ArmGeometry;
pub use sequence::{
    FREE_CLEARANCE_M, GraspConfig, GraspOutcome, GraspReport, LOOK_AT_M, LOOK_HEIGHT_M, LookOut, MIN_CONFIRMING_SCORE,
    PlacingConfig, PlacingOutcome, PlacingReport, SURE, camera_looking_down, grasp, grasp_and_place, grasp_softly,
};
pub use surroundings::{Destination, Surroundings, Way};
pub use touch::{Descent, TouchDown, Touched};
pub use watch::{HISTORY_SECS, MAX_SILENCE_SECS, StopReason, StopRequest, Watch};
