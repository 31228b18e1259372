//! Control loops: a closure that answers every state, once per millisecond.
//!
//! A closure returns [`ControlFlow::Continue`] with the next command, or [`ControlFlow::Break`] with the last one,
//! which should leave the arm at rest: if the arm still moves then, the robot reports an error.

use std::ops::ControlFlow;
use std::time::Duration;

use super::robot::{Robot, decode_response};
use crate::error::{FciError, Result};
use crate::pose::is_rigid;
use crate::wire::{
    Command, ControllerMode, Deviation, MotionCommand, MotionGeneratorMode, MoveRequest, Request, RobotCommand,
    RobotMode, RobotState, Status, Transform, Version,
};

/// Allowed deviations that no motion of this client exceeds: 10 m, 3.12 rad (libfranka's default).
const ANY_DEVIATION: Deviation = Deviation { translation: 10.0, rotation: 3.12, elbow: 2.0 * std::f64::consts::PI };

/// The robot's internal controller, which follows the references.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum InternalController {
    /// Impedance in the joints.
    JointImpedance,
    /// Impedance of the end effector.
    CartesianImpedance,
}

impl From<InternalController> for ControllerMode {
    fn from(controller: InternalController) -> Self {
        match controller {
            InternalController::JointImpedance => ControllerMode::JointImpedance,
            InternalController::CartesianImpedance => ControllerMode::CartesianImpedance,
        }
    }
}

/// The answer of a closure: the next value or the last one.
pub type Answer<T> = ControlFlow<T, T>;

impl Robot {
    /// Commands joint positions (rad), one command for each state.
    ///
    /// The closure gets the state and the time since the previous state by the robot's clock (zero at first). The first
    /// command may differ from `state.q_desired` only by a small step.
    ///
    /// # Errors
    /// [`FciError::Motion`] if the robot ended the motion, with its errors; [`FciError::Refused`] if it did not start;
    /// [`FciError::Command`] for a command that is not finite, which ends the motion; the errors of the connection.
    pub fn control_joint_positions(
        &mut self,
        controller: InternalController,
        mut motion: impl FnMut(&RobotState, Duration) -> Answer<[f64; 7]>,
    ) -> Result<RobotState> {
        self.control(controller.into(), MotionGeneratorMode::JointPosition, |state, step| {
            map(motion(state, step), |q| with_motion(MotionCommand { q, ..MotionCommand::default() }))
        })
    }

    /// Commands joint velocities (rad/s); see [`Robot::control_joint_positions`].
    ///
    /// # Errors
    /// As for [`Robot::control_joint_positions`].
    pub fn control_joint_velocities(
        &mut self,
        controller: InternalController,
        mut motion: impl FnMut(&RobotState, Duration) -> Answer<[f64; 7]>,
    ) -> Result<RobotState> {
        self.control(controller.into(), MotionGeneratorMode::JointVelocity, |state, step| {
            map(motion(state, step), |dq| with_motion(MotionCommand { dq, ..MotionCommand::default() }))
        })
    }

    /// Commands poses of the end effector in the base frame, starting at `state.base_from_ee_commanded`; see
    /// [`Robot::control_joint_positions`].
    ///
    /// # Errors
    /// As for [`Robot::control_joint_positions`], and [`FciError::Command`] for a matrix that is not a pose.
    pub fn control_poses(
        &mut self,
        controller: InternalController,
        mut motion: impl FnMut(&RobotState, Duration) -> Answer<Transform>,
    ) -> Result<RobotState> {
        self.control(controller.into(), MotionGeneratorMode::CartesianPosition, |state, step| {
            map(motion(state, step), |base_from_ee| {
                with_motion(MotionCommand { base_from_ee, ..MotionCommand::default() })
            })
        })
    }

    /// Commands twists of the end effector in the base frame (m/s, rad/s); see [`Robot::control_joint_positions`].
    ///
    /// # Errors
    /// As for [`Robot::control_joint_positions`].
    pub fn control_twists(
        &mut self,
        controller: InternalController,
        mut motion: impl FnMut(&RobotState, Duration) -> Answer<[f64; 6]>,
    ) -> Result<RobotState> {
        self.control(controller.into(), MotionGeneratorMode::CartesianVelocity, |state, step| {
            map(motion(state, step), |twist| with_motion(MotionCommand { twist, ..MotionCommand::default() }))
        })
    }

    /// Commands torques (N·m), to which the robot adds gravity compensation; see [`Robot::control_joint_positions`].
    ///
    /// # Errors
    /// As for [`Robot::control_joint_positions`].
    pub fn control_torques(
        &mut self,
        mut controller: impl FnMut(&RobotState, Duration) -> Answer<[f64; 7]>,
    ) -> Result<RobotState> {
        // Version 5 has no pure torque mode: a generator of zero velocities runs in parallel.
        let generator = match self.version {
            Version::V5 => MotionGeneratorMode::JointVelocity,
            Version::V10 => MotionGeneratorMode::None,
        };
        self.control(ControllerMode::External, generator, |state, step| {
            map(controller(state, step), |torque| RobotCommand { torque, ..RobotCommand::default() })
        })
    }

    /// Sends commands for any combination of generator and controller; the closure sets the fields that both use. This
    /// function sets `message_id` and the flags that end the motion.
    ///
    /// # Errors
    /// As for [`Robot::control_joint_positions`].
    pub fn control(
        &mut self,
        controller: ControllerMode,
        generator: MotionGeneratorMode,
        mut answer: impl FnMut(&RobotState, Duration) -> Answer<RobotCommand>,
    ) -> Result<RobotState> {
        self.control_unchecked(controller, generator, |state, step| {
            let answer = answer(state, step);
            let (ControlFlow::Continue(command) | ControlFlow::Break(command)) = &answer;
            check(command, controller, generator)?;
            Ok(Some(answer))
        })
    }

    /// As [`Robot::control`] without checks of the commands, for tests of servers. `None` leaves a state without an
    /// answer; an error of the closure ends the motion.
    #[doc(hidden)]
    pub fn control_unchecked(
        &mut self,
        controller: ControllerMode,
        generator: MotionGeneratorMode,
        mut answer: impl FnMut(&RobotState, Duration) -> Result<Option<Answer<RobotCommand>>>,
    ) -> Result<RobotState> {
        self.statistics.reset();
        let id = self.start_motion(controller, generator)?;
        let mut last_id = self.state.message_id;
        loop {
            let step = Duration::from_millis(self.state.message_id - last_id);
            last_id = self.state.message_id;
            match answer(&self.state, step) {
                Ok(Some(ControlFlow::Continue(command))) => self.send(command)?,
                Ok(Some(ControlFlow::Break(command))) => return self.finish_motion(id, command),
                Ok(None) => {}
                Err(error) => {
                    self.cancel_motion(id);
                    return Err(error);
                }
            }
            self.receive(false)?;
            self.statistics.received(self.state.message_id);
            self.check_motion(id, controller, generator)?;
        }
    }

    /// Sends the Move, and waits for its acceptance and for the first state within the motion.
    fn start_motion(&mut self, controller: ControllerMode, generator: MotionGeneratorMode) -> Result<u32> {
        self.session.forget_responses();
        let request = Request::Move(MoveRequest {
            controller,
            generator,
            max_path_deviation: ANY_DEVIATION,
            max_goal_deviation: ANY_DEVIATION,
        });
        let version = self.version;
        if request.encode(0, version).is_none() {
            return Err(FciError::Refused { command: Command::Move.name(), status: Status::InvalidArgument });
        }
        let id = self.session.sending.send(|id| request.encode(id, version).unwrap_or_default())?;
        let payload = self.session.wait_for(id, "answer to the start of a motion", Some(self.session.timeout()))?;
        match decode_response(&self.session, &payload, Command::Move, version)?.status {
            Status::MotionStarted => {}
            status => return Err(FciError::Refused { command: Command::Move.name(), status }),
        }
        self.receive(false)?;
        while !self.runs(controller, generator) {
            if let Some(payload) = self.session.poll(id)? {
                return Err(self.motion_error(&payload));
            }
            self.receive(false)?;
        }
        self.statistics.received(self.state.message_id);
        Ok(id)
    }

    fn runs(&self, controller: ControllerMode, generator: MotionGeneratorMode) -> bool {
        let state = &self.state;
        state.robot_mode == RobotMode::Move
            && state.controller_mode == controller
            && state.motion_generator_mode == generator
    }

    /// Fails if the robot has left the motion, with the reason from its second answer to the Move.
    fn check_motion(&mut self, id: u32, controller: ControllerMode, generator: MotionGeneratorMode) -> Result<()> {
        if self.runs(controller, generator) {
            return Ok(());
        }
        let payload = self.session.wait_for(id, "answer to the end of a motion", Some(self.session.timeout()))?;
        Err(self.motion_error(&payload))
    }

    fn motion_error(&self, payload: &[u8]) -> FciError {
        let response = match decode_response(&self.session, payload, Command::Move, self.version) {
            Ok(response) => response,
            Err(error) => return error,
        };
        // The last state is outside the motion and has a rate of zero. The rate comes from the last state within the
        // motion, reduced by the commands lost since then.
        let success_rate =
            self.recent.iter().rev().find(|state| state.robot_mode == RobotMode::Move).map_or(0.0, |last| {
                let num_lost = self.state.message_id.saturating_sub(last.message_id + 1);
                last.control_command_success_rate * (1.0 - num_lost as f64 / 100.0).max(0.0)
            });
        // On a Panda, `errors` and `reflex_reason` are equal; some servers accumulate the latter over several motions.
        let errors = if self.state.errors.is_empty() { self.state.reflex_reason } else { self.state.errors };
        FciError::Motion { status: response.status, errors, success_rate }
    }

    fn send(&mut self, command: RobotCommand) -> Result<()> {
        let command = RobotCommand { message_id: self.state.message_id, ..command };
        self.session.answer(&command.encode(self.version))?;
        self.statistics.answered();
        Ok(())
    }

    /// Repeats the last command, marked as such, until the robot has left the motion.
    fn finish_motion(&mut self, id: u32, mut command: RobotCommand) -> Result<RobotState> {
        command.motion.finished = true;
        command.torque_finished = true;
        loop {
            self.send(command.clone())?;
            self.receive(false)?;
            if self.state.robot_mode != RobotMode::Move || self.state.motion_generator_mode == MotionGeneratorMode::Idle
            {
                break;
            }
            self.statistics.received(self.state.message_id);
        }
        let payload = self.session.wait_for(id, "answer to the end of a motion", Some(self.session.timeout()))?;
        match decode_response(&self.session, &payload, Command::Move, self.version)?.status {
            Status::Success => Ok(self.state.clone()),
            _ => Err(self.motion_error(&payload)),
        }
    }

    /// Ends a motion whose closure failed. The robot's answer is ignored, because the closure's error is reported.
    fn cancel_motion(&mut self, id: u32) {
        if self.stop().is_ok() {
            let _ = self.session.wait_for(id, "answer to the end of a motion", Some(self.session.timeout()));
        }
    }
}

fn map<T, U>(answer: Answer<T>, mut change: impl FnMut(T) -> U) -> Answer<U> {
    match answer {
        ControlFlow::Continue(value) => ControlFlow::Continue(change(value)),
        ControlFlow::Break(value) => ControlFlow::Break(change(value)),
    }
}

fn with_motion(motion: MotionCommand) -> RobotCommand {
    RobotCommand { motion, ..RobotCommand::default() }
}

/// Rejects commands that must not be sent to a robot.
fn check(command: &RobotCommand, controller: ControllerMode, generator: MotionGeneratorMode) -> Result<()> {
    let finite = |field: &'static str, values: &[f64]| match values.iter().find(|value| !value.is_finite()) {
        None => Ok(()),
        Some(value) => Err(FciError::Command { field, expected: "finite numbers", found: value.to_string() }),
    };
    let motion = &command.motion;
    if controller == ControllerMode::External {
        finite("torque", &command.torque)?;
    }
    match generator {
        MotionGeneratorMode::JointPosition => finite("q", &motion.q),
        MotionGeneratorMode::JointVelocity => finite("dq", &motion.dq),
        MotionGeneratorMode::CartesianVelocity => finite("twist", &motion.twist),
        MotionGeneratorMode::CartesianPosition => {
            finite("pose", &motion.base_from_ee)?;
            if is_rigid(&motion.base_from_ee) {
                return Ok(());
            }
            let found = format!("{:?}", motion.base_from_ee);
            Err(FciError::Command { field: "pose", expected: "a rotation and a translation, column by column", found })
        }
        MotionGeneratorMode::None | MotionGeneratorMode::Idle => Ok(()),
    }
}
