//! A running motion: converts a client's command to the next reference, or to the errors that stop the robot.

use nalgebra::Isometry3;

use super::cartesian::{CartesianReference, elbow_of, joint_step};
use super::communication::Communication;
use super::plant::{Jacobian, JointVector};
use super::reference::{JointReference, PERIOD_SECS, ROUNDING};
use crate::limits::Limits;
use crate::pose::difference;
use crate::wire::robot_error::{RobotError, RobotErrors};
use crate::wire::{ControllerMode, MotionCommand, MotionGeneratorMode, RobotCommand};

/// Largest distance of a motion's first position from the reference. Not published by libfranka; the value is that of
/// franka-sim, another simulated robot.
const START_POSITION_RAD: f64 = 0.1;

/// Function from joint positions to `base_from_ee` and the Jacobian of the end effector.
pub type EndEffectorAt<'a> = &'a dyn Fn(&JointVector) -> (Isometry3<f64>, Jacobian);

/// The references of a robot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct References {
    /// `q_d` and its derivatives.
    pub joints: JointReference,
    /// `O_T_EE_c` and its derivatives.
    pub cartesian: CartesianReference,
    /// `tau_J_d`, which excludes gravity.
    pub torque: JointVector,
}

/// State of a running motion.
#[derive(Debug, Clone)]
pub struct Motion {
    /// Number of the Move request.
    pub command_id: u32,
    /// The controller, which computes the torques.
    pub controller: ControllerMode,
    /// The generator, which computes the references.
    pub generator: MotionGeneratorMode,
    /// The record of answered cycles.
    pub communication: Communication,
    /// Whether the last command contained the elbow.
    is_elbow_given: bool,
}

impl Motion {
    /// The state of a motion that was just requested.
    pub fn new(command_id: u32, controller: ControllerMode, generator: MotionGeneratorMode) -> Self {
        Self { command_id, controller, generator, communication: Communication::default(), is_elbow_given: false }
    }

    /// The references after a cycle and whether the motion has ended; otherwise the errors that stop the robot.
    pub fn follow(
        &mut self,
        last: &References,
        command: Option<&RobotCommand>,
        limits: &Limits,
        end_effector_at: EndEffectorAt,
    ) -> Result<(References, bool), RobotErrors> {
        let is_first = !self.communication.has_started();
        self.communication.count(command.is_some());
        if self.communication.is_violated() {
            return Err(RobotError::CommunicationConstraintsViolation.into());
        }
        let Some(command) = command else {
            return Ok((if is_first { *last } else { self.extrapolate(last, end_effector_at) }, false));
        };
        self.is_elbow_given = command.motion.valid_elbow;
        let mut next = self.generate(last, &command.motion, is_first, limits, end_effector_at)?;
        if self.controller == ControllerMode::External {
            next.torque = self.checked_torque(last, command, limits)?;
        }
        if command.motion.finished {
            // A motion must end at rest, because a constant reference follows it.
            let stopped = next.joints.after_velocity(JointVector::zeros());
            let errors = stopped.violations(&next.joints, limits, self.generator);
            if !errors.is_empty() {
                return Err(errors);
            }
        }
        Ok((next, command.motion.finished))
    }

    fn generate(
        &self,
        last: &References,
        command: &MotionCommand,
        is_first: bool,
        limits: &Limits,
        end_effector_at: EndEffectorAt,
    ) -> Result<References, RobotErrors> {
        self.check_finite(command)?;
        let next = match self.generator {
            MotionGeneratorMode::JointPosition => {
                let q = JointVector::from(command.q);
                if is_first && (q - last.joints.q).amax() > START_POSITION_RAD {
                    return Err(RobotError::JointPositionMotionGeneratorStartPoseInvalid.into());
                }
                with_joints(last, last.joints.after_position(q), end_effector_at)
            }
            MotionGeneratorMode::JointVelocity => {
                with_joints(last, last.joints.after_velocity(JointVector::from(command.dq)), end_effector_at)
            }
            MotionGeneratorMode::CartesianPosition => {
                let cartesian = last.cartesian.after_pose(command, is_first, limits)?;
                with_cartesian(last, cartesian, command.valid_elbow, end_effector_at)
            }
            MotionGeneratorMode::CartesianVelocity => {
                let cartesian = last.cartesian.after_twist(command, is_first, limits)?;
                with_cartesian(last, cartesian, command.valid_elbow, end_effector_at)
            }
            MotionGeneratorMode::None | MotionGeneratorMode::Idle => *last,
        };
        let errors = next.joints.violations(&last.joints, limits, self.generator);
        if errors.is_empty() { Ok(next) } else { Err(errors) }
    }

    /// Checks that the command is finite: libfranka sends only finite numbers.
    fn check_finite(&self, command: &MotionCommand) -> Result<(), RobotErrors> {
        let is_finite = |values: &[f64]| values.iter().all(|value| value.is_finite());
        let error = match self.generator {
            MotionGeneratorMode::JointPosition if !is_finite(&command.q) => {
                RobotError::JointMotionGeneratorPositionLimitsViolation
            }
            MotionGeneratorMode::JointVelocity if !is_finite(&command.dq) => {
                RobotError::JointMotionGeneratorVelocityLimitsViolation
            }
            MotionGeneratorMode::CartesianVelocity if !is_finite(&command.twist) => {
                RobotError::CartesianMotionGeneratorVelocityLimitsViolation
            }
            MotionGeneratorMode::CartesianPosition | MotionGeneratorMode::CartesianVelocity
                if command.valid_elbow && !is_finite(&command.elbow) =>
            {
                RobotError::CartesianMotionGeneratorElbowLimitViolation
            }
            _ => return Ok(()),
        };
        Err(error.into())
    }

    fn checked_torque(
        &self,
        last: &References,
        command: &RobotCommand,
        limits: &Limits,
    ) -> Result<JointVector, RobotErrors> {
        let torque = JointVector::from(command.torque);
        let mut errors = RobotErrors::default();
        // With this form of the comparison, NaN counts as out of range.
        if !torque.iter().zip(&limits.torque).all(|(torque, limit)| torque.abs() <= limit * ROUNDING) {
            errors.insert(RobotError::TauJRangeViolation);
        }
        if !((torque - last.torque) / PERIOD_SECS).iter().all(|rate| rate.abs() <= limits.torque_rate * ROUNDING) {
            errors.insert(RobotError::ControllerTorqueDiscontinuity);
        }
        if errors.is_empty() { Ok(torque) } else { Err(errors) }
    }

    /// The references after a lost command: motions continue at constant acceleration, torques keep their value.
    fn extrapolate(&self, last: &References, end_effector_at: EndEffectorAt) -> References {
        match self.generator {
            MotionGeneratorMode::CartesianPosition | MotionGeneratorMode::CartesianVelocity => {
                with_cartesian(last, last.cartesian.extrapolated(), self.is_elbow_given, end_effector_at)
            }
            _ => with_joints(last, last.joints.extrapolated(), end_effector_at),
        }
    }
}

/// The references of a joint motion: the Cartesian reference follows from the joints' reference.
fn with_joints(last: &References, joints: JointReference, end_effector_at: EndEffectorAt) -> References {
    let (pose, jacobian) = end_effector_at(&joints.q);
    let twist = jacobian * joints.dq;
    let cartesian = CartesianReference {
        pose,
        twist,
        twist_rate: (twist - last.cartesian.twist) / PERIOD_SECS,
        elbow: elbow_of(&joints.q),
        elbow_velocity: joints.dq[2],
        elbow_acceleration: joints.ddq[2],
    };
    References { joints, cartesian, ..*last }
}

/// The references of a Cartesian motion: the joints follow with one Newton step per cycle, from their present
/// reference.
fn with_cartesian(
    last: &References,
    cartesian: CartesianReference,
    is_elbow_given: bool,
    end_effector_at: EndEffectorAt,
) -> References {
    let (pose, jacobian) = end_effector_at(&last.joints.q);
    let elbow_step = is_elbow_given.then(|| cartesian.elbow[0] - last.joints.q[2]);
    let step = joint_step(&jacobian, &difference(&pose, &cartesian.pose), elbow_step);
    let joints = last.joints.after_position(last.joints.q + step);
    let cartesian = if is_elbow_given {
        cartesian
    } else {
        CartesianReference {
            elbow: elbow_of(&joints.q),
            elbow_velocity: joints.dq[2],
            elbow_acceleration: joints.ddq[2],
            ..cartesian
        }
    };
    References { joints, cartesian, ..*last }
}
