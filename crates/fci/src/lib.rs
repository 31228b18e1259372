//! Franka Control Interface: a client that drives a robot, and a server that makes a simulation behave like one.
//!
//! ```text
//!  client::Robot ──requests, TCP 1337──>  server ── torques ──> Plant (a simulation)
//!        <── states, UDP, 1 kHz ──         checks, references,  <── positions, velocities
//!        ── commands, UDP ──>              impedance control
//!  client::Hand  ──requests, TCP 1338──>  hand
//! ```
//!
//! A Panda uses version 5 of the protocol (libfranka 0.9), an FR3 version 10 (libfranka 0.18 and later). The server
//! supports version 5, the client both. This crate gets all kinematics from a [`server::Plant`], and uses threads
//! instead of an asynchronous runtime.
//!
//! ```no_run
//! use std::ops::ControlFlow;
//! use sdg_fci::client::{InternalController, Robot, RobotConfig};
//!
//! # fn main() -> Result<(), sdg_fci::FciError> {
//! let mut robot = Robot::connect("172.16.0.2", &RobotConfig::default())?;
//! let (start, mut time) = (robot.read_state()?.q_desired, 0.0);
//! // A joint swings once, 0.2 rad, in 4 s.
//! robot.control_joint_positions(InternalController::JointImpedance, |_, step| {
//!     time += step.as_secs_f64();
//!     let mut q = start;
//!     q[3] += 0.1 * (1.0 - (std::f64::consts::FRAC_PI_2 * time).cos());
//!     if time < 4.0 { ControlFlow::Continue(q) } else { ControlFlow::Break(start) }
//! })?;
//! # Ok(())
//! # }
//! ```
#![forbid(unsafe_code)]
#![cfg_attr(test, allow(clippy::unwrap_used))]

pub mod client;
mod error;
mod limits;
mod message;
mod pose;
pub mod server;
pub mod wire;
mod wire_error;

pub use error::{FciError, Result};
pub use limits::{Limits, RateLimits, VelocityNearEnd};
pub use message::read_message;
pub use pose::{is_rigid, isometry, transform};
pub use wire::robot_error::{NUM_ERRORS, RobotError, RobotErrors};
pub use wire_error::WireError;
