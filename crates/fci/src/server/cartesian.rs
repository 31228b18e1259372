//! Poses, twists and the elbow: computes the next reference from a command, checks it against the limits, and computes
//! the joint motion that leads to it.

use nalgebra::{Isometry3, SMatrix, Vector6};

use super::plant::{Jacobian, JointVector};
use super::reference::{PERIOD_SECS, ROUNDING};
use crate::limits::{Limits, RateLimits};
use crate::pose::{difference, is_rigid, isometry, moved};
use crate::wire::MotionCommand;
use crate::wire::robot_error::{RobotError, RobotErrors};

/// Largest distance of a motion's first pose from the end effector. Not published by libfranka; the value is that of
/// franka-sim, another simulated robot.
const START_TRANSLATION_M: f64 = 0.05;
const START_ROTATION_RAD: f64 = 0.1;
/// Largest distance of the first elbow from the measured one. Not published by libfranka; the value is franka-sim's.
const START_ELBOW_RAD: f64 = 0.1;
/// Smallest singular value of the Jacobian at which a Cartesian motion may start. Not published by libfranka; the value
/// is franka-sim's.
pub const MIN_SINGULAR_VALUE: f64 = 0.05;
/// Damping that keeps the inverse bounded near singular poses; with 1e-3 the error of a pose is still below a
/// micrometre in the next cycle.
const DAMPING: f64 = 1e-3;

/// The reference of the end effector from the client's commands: `O_T_EE_c`, `O_dP_EE_c`, `O_ddP_EE_c`, `elbow_c` and
/// its derivatives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CartesianReference {
    /// `base_from_ee`.
    pub pose: Isometry3<f64>,
    /// Twist in the base frame, m/s and rad/s.
    pub twist: Vector6<f64>,
    /// Derivative of the twist, m/s² and rad/s².
    pub twist_rate: Vector6<f64>,
    /// Position of joint 3 and sign of joint 4.
    pub elbow: [f64; 2],
    /// Velocity of joint 3, rad/s.
    pub elbow_velocity: f64,
    /// Acceleration of joint 3, rad/s².
    pub elbow_acceleration: f64,
}

impl CartesianReference {
    /// A reference at rest at a pose, with the elbow of the joint positions `q`.
    pub fn at_rest(pose: Isometry3<f64>, q: &JointVector) -> Self {
        Self {
            pose,
            twist: Vector6::zeros(),
            twist_rate: Vector6::zeros(),
            elbow: elbow_of(q),
            elbow_velocity: 0.0,
            elbow_acceleration: 0.0,
        }
    }

    /// The reference after a commanded pose, or the error for which the robot stops.
    pub fn after_pose(&self, command: &MotionCommand, is_first: bool, limits: &Limits) -> Result<Self, RobotErrors> {
        if !is_rigid(&command.base_from_ee) {
            return Err(RobotError::CartesianPositionMotionGeneratorInvalidFrameFlag.into());
        }
        let pose = isometry(&command.base_from_ee);
        let motion = difference(&self.pose, &pose);
        if is_first
            && (motion.fixed_rows::<3>(0).norm() > START_TRANSLATION_M
                || motion.fixed_rows::<3>(3).norm() > START_ROTATION_RAD)
        {
            return Err(RobotError::CartesianPositionMotionGeneratorStartPoseInvalid.into());
        }
        let acceleration_error = RobotError::CartesianMotionGeneratorVelocityDiscontinuity;
        self.to(pose, motion / PERIOD_SECS, acceleration_error, command, is_first, limits)
    }

    /// The reference after a commanded twist, or the error for which the robot stops.
    pub fn after_twist(&self, command: &MotionCommand, is_first: bool, limits: &Limits) -> Result<Self, RobotErrors> {
        let twist = Vector6::from(command.twist);
        // The error is named after the interface: with twists, the command is a velocity.
        let acceleration_error = RobotError::CartesianMotionGeneratorAccelerationDiscontinuity;
        self.to(moved(&self.pose, &(twist * PERIOD_SECS)), twist, acceleration_error, command, is_first, limits)
    }

    /// The reference after a cycle without a command: constant acceleration.
    pub fn extrapolated(&self) -> Self {
        let twist = self.twist + self.twist_rate * PERIOD_SECS;
        let elbow_velocity = self.elbow_velocity + self.elbow_acceleration * PERIOD_SECS;
        Self {
            pose: moved(&self.pose, &(twist * PERIOD_SECS)),
            twist,
            elbow: [self.elbow[0] + elbow_velocity * PERIOD_SECS, self.elbow[1]],
            elbow_velocity,
            ..*self
        }
    }

    fn to(
        &self,
        pose: Isometry3<f64>,
        twist: Vector6<f64>,
        acceleration_error: RobotError,
        command: &MotionCommand,
        is_first: bool,
        limits: &Limits,
    ) -> Result<Self, RobotErrors> {
        let next = Self { pose, twist, twist_rate: (twist - self.twist) / PERIOD_SECS, ..*self };
        let next = next.with_elbow(command, is_first, limits)?;
        let jerk = (next.twist_rate - self.twist_rate) / PERIOD_SECS;
        let exceeds = |values: &Vector6<f64>, limit: fn(&RateLimits) -> f64| {
            values.fixed_rows::<3>(0).norm() > limit(&limits.translation) * ROUNDING
                || values.fixed_rows::<3>(3).norm() > limit(&limits.rotation) * ROUNDING
        };
        let violated = [
            (RobotError::CartesianMotionGeneratorVelocityLimitsViolation, exceeds(&next.twist, |rate| rate.velocity)),
            (acceleration_error, exceeds(&next.twist_rate, |rate| rate.acceleration)),
            (RobotError::CartesianMotionGeneratorAccelerationDiscontinuity, exceeds(&jerk, |rate| rate.jerk)),
        ];
        let errors: RobotErrors =
            violated.into_iter().filter_map(|(name, violated)| violated.then_some(name)).collect();
        if errors.is_empty() { Ok(next) } else { Err(errors) }
    }

    fn with_elbow(self, command: &MotionCommand, is_first: bool, limits: &Limits) -> Result<Self, RobotErrors> {
        if !command.valid_elbow {
            return Ok(self);
        }
        let [position, sign] = command.elbow;
        if is_first && (position - self.elbow[0]).abs() > START_ELBOW_RAD {
            return Err(RobotError::CartesianMotionGeneratorStartElbowInvalid.into());
        }
        if sign != self.elbow[1] {
            return Err(RobotError::CartesianMotionGeneratorElbowSignInconsistent.into());
        }
        let velocity = (position - self.elbow[0]) / PERIOD_SECS;
        let acceleration = (velocity - self.elbow_velocity) / PERIOD_SECS;
        let jerk = (acceleration - self.elbow_acceleration) / PERIOD_SECS;
        let RateLimits { velocity: max_velocity, acceleration: max_acceleration, jerk: max_jerk } = limits.elbow;
        if !(limits.q_min[2]..=limits.q_max[2]).contains(&position)
            || velocity.abs() > max_velocity * ROUNDING
            || acceleration.abs() > max_acceleration * ROUNDING
            || jerk.abs() > max_jerk * ROUNDING
        {
            return Err(RobotError::CartesianMotionGeneratorElbowLimitViolation.into());
        }
        Ok(Self { elbow: command.elbow, elbow_velocity: velocity, elbow_acceleration: acceleration, ..self })
    }
}

/// Joint 3 and the sign of joint 4.
pub fn elbow_of(q: &JointVector) -> [f64; 2] {
    [q[2], if q[3] < 0.0 { -1.0 } else { 1.0 }]
}

/// The smallest singular value of a Jacobian.
pub fn smallest_singular_value(jacobian: &Jacobian) -> f64 {
    let values = (jacobian * jacobian.transpose()).symmetric_eigenvalues();
    values.min().max(0.0).sqrt()
}

/// The step of the joints that moves the end effector by `motion` (m and rad in the base frame). If the elbow is
/// commanded, joint 3 moves by `elbow_step`; otherwise the result is the smallest such step.
pub fn joint_step(jacobian: &Jacobian, motion: &Vector6<f64>, elbow_step: Option<f64>) -> JointVector {
    match elbow_step {
        None => damped_step(jacobian, motion),
        Some(elbow_step) => {
            // The motion of joint 3 is given; the other six joints supply the rest of the motion.
            let given = jacobian.column(2) * elbow_step;
            let mut others = *jacobian;
            others.column_mut(2).fill(0.0);
            let mut step = damped_step(&others, &(motion - given));
            step[2] = elbow_step;
            step
        }
    }
}

fn damped_step(jacobian: &Jacobian, motion: &Vector6<f64>) -> JointVector {
    let square = jacobian * jacobian.transpose() + SMatrix::<f64, 6, 6>::identity() * (DAMPING * DAMPING);
    // The matrix is positive definite, so that a factor exists.
    square.cholesky().map_or_else(JointVector::zeros, |factor| jacobian.transpose() * factor.solve(motion))
}
