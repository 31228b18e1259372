//! Kinematics of an arm: the pose of its hand, configurations for a pose, and motions within its limits. The geometry
//! is data: [`ArmGeometry::panda`], [`ArmGeometry::fr3`].
//!
//! ```text
//! base_from_tcp ──► inverse ──► q ──► point-to-point trajectory ─┐
//!                                ├──► straight path ──► timed ───┼──► Trajectory::sample(t) = q, q̇, q̈
//! Plan ──► waypoints ──► rounded path ─────────────────► timed ───┘
//! ```
//!
//! [`collision`] checks contacts of the arm, [`planning`] finds motions around obstacles, [`dynamics`] computes the
//! torques of a motion.
//!
//! Not in this crate: communication with a real robot.
//!
//! ```
//! use nalgebra::{Isometry3, UnitQuaternion, Vector3};
//! use sdg_kinematics::{ArmGeometry, IkOptions, ready_pose};
//!
//! let panda = ArmGeometry::panda();
//! let down = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
//! let base_from_tcp = Isometry3::from_parts(Vector3::new(0.5, 0.1, 0.2).into(), down);
//! let solution = panda.inverse(&base_from_tcp, &ready_pose(), &IkOptions::default())?;
//! let reached = panda.forward(&solution.q);
//! assert!((reached.translation.vector - base_from_tcp.translation.vector).norm() < 1e-6);
//! # Ok::<(), sdg_kinematics::KinematicsError>(())
//! ```
#![forbid(unsafe_code)]
#![cfg_attr(test, allow(clippy::unwrap_used))]

mod analytic;
mod approach;
mod arms;
mod capsule;
mod check;
mod clearance;
pub mod collision;
pub mod dynamics;
mod error;
mod geometry;
mod ik;
mod inertia;
mod inverse;
mod joints;
mod limits;
mod nearest;
mod path;
pub mod planning;
mod rounded_path;
#[cfg(test)]
mod test_poses;
mod timing;
mod trajectory;

pub use approach::{Approach, GraspSymmetry, with_fingers_exchanged};
pub use arms::{FINGER_HALF_WIDTH_M, HAND_OPENING_MAX_M, TCP_OFFSET_M, finger_thickness_m};
pub use clearance::Clearance;
pub use error::KinematicsError;
pub use geometry::{
    ArmGeometry, ArmPart, ClosedForm, DhJoint, FingerCapsule, FingerGeometry, Frames, HandGeometry, Jacobian,
};
pub use ik::{IkOptions, IkSolution};
pub use joints::{JointVector, LimitViolation, NUM_JOINTS, READY_RAD, ready_pose};
pub use limits::{CartesianLimits, JointLimits};
pub use nalgebra;
pub use path::{JointPath, LineOptions, PathPoint};
pub use rounded_path::RoundedPath;
pub use trajectory::Trajectory;

/// Runs the README's example with the other doc tests.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
