//! Motions that change one signal.

use std::ops::ControlFlow;
use std::time::Duration;

use sdg_fci::client::{Answer, InternalController, Robot};
use sdg_fci::wire::{ControllerMode, MotionCommand, MotionGeneratorMode, RobotCommand, RobotState, Transform, Version};
use sdg_fci::{FciError, isometry, transform};

use super::profile::Profile;

/// The commanded quantity of a motion.
#[derive(Debug, Clone)]
pub enum Signal {
    /// A joint's position.
    JointPosition { joint: usize, profile: Profile },
    /// A joint's velocity.
    JointVelocity { joint: usize, profile: Profile },
    /// The rotation of the end effector about the base's z, as poses.
    Pose { profile: Profile },
    /// The rotation of the end effector about the base's z, as twists.
    Twist { profile: Profile },
    /// The path of the end effector along an axis of the base, as poses.
    PoseAlong { axis: Axis, profile: Profile },
    /// The path of the end effector along an axis of the base, as twists.
    TwistAlong { axis: Axis, profile: Profile },
    /// The elbow, with the end effector at rest.
    Elbow { profile: Profile },
    /// The torque of joint 7, with the other joints at rest.
    Torque { profile: Profile },
    /// Joint 7 brought to a velocity by torques.
    SpunJoint { profile: Profile },
    /// The first commanded position of joint 1 has this error.
    StartPosition { offset: f64 },
    /// The first commanded pose has this error along x.
    StartPose { offset: f64 },
    /// The first commanded elbow has this error.
    StartElbow { offset: f64 },
    /// The elbow's sign changes after 20 cycles, or not.
    ElbowSign { changes: bool },
    /// The rotation of the commanded pose is multiplied by `scale` after 20 cycles.
    Frame { scale: f64 },
    /// `num` successive answers are omitted.
    Unanswered { num: u64 },
    /// The speed of an end effector whose frame is [`FAR_END_M`] beyond the finger tips; joint 6 moves it.
    FarEnd { profile: Profile },
    /// A constant pose: that of the arm at the joint positions `from`.
    StandingPose { from: [f64; 7] },
}

/// An axis of the base.
#[derive(Debug, Clone, Copy)]
pub enum Axis {
    /// Forward: joint 2 moves most.
    X,
    /// Sideways: joints 3, 5 and 7 move most.
    Y,
}

/// Distance by which [`Signal::FarEnd`] moves the end effector along its own z, m.
const FAR_END_M: f64 = 2.0;
/// Distances from joint 6's axis to the flange, along the flange's z and across it, m.
const JOINT_6_TO_FLANGE_M: [f64; 2] = [0.107, 0.088];

/// Moves the joints slowly.
pub fn go_to(robot: &mut Robot, goal: &[f64; 7]) -> Result<(), FciError> {
    let start = robot.read_state()?.q_desired;
    let distance = (0..7).map(|joint| (goal[joint] - start[joint]).abs()).fold(0.0, f64::max);
    if distance < 1e-4 {
        return Ok(());
    }
    let profile = Profile::distance(1.0, 1000 + (distance * 2000.0) as u32);
    let mut clock = Clock::default();
    robot.control_joint_positions(InternalController::JointImpedance, |_, step| {
        let ms = clock.tick(step);
        let share = profile.offset(ms);
        let q = std::array::from_fn(|joint| start[joint] + share * (goal[joint] - start[joint]));
        answer(q, profile.is_over(ms))
    })?;
    Ok(())
}

/// Milliseconds since the first state of a motion, by the robot's clock.
#[derive(Debug, Default)]
struct Clock(u64);

impl Clock {
    fn tick(&mut self, step: Duration) -> u64 {
        self.0 += step.as_millis() as u64;
        self.0
    }
}

fn answer<T>(value: T, is_last: bool) -> Answer<T> {
    if is_last { ControlFlow::Break(value) } else { ControlFlow::Continue(value) }
}

/// Duration of motions without a profile.
const STANDING_MS: u64 = 100;
/// Number of cycles at rest before a profile starts.
const PROFILE_START_MS: u64 = 30;
/// The cycle in which motions without a profile change.
const EVENT_MS: u64 = 20;

impl Signal {
    fn generator(&self, version: Version) -> (ControllerMode, MotionGeneratorMode) {
        let generator = match self {
            Signal::JointPosition { .. } | Signal::StartPosition { .. } | Signal::Unanswered { .. } => {
                MotionGeneratorMode::JointPosition
            }
            Signal::JointVelocity { .. } | Signal::FarEnd { .. } => MotionGeneratorMode::JointVelocity,
            Signal::Twist { .. } | Signal::TwistAlong { .. } => MotionGeneratorMode::CartesianVelocity,
            Signal::Torque { .. } | Signal::SpunJoint { .. } => {
                let generator = match version {
                    Version::V5 => MotionGeneratorMode::JointVelocity,
                    Version::V10 => MotionGeneratorMode::None,
                };
                return (ControllerMode::External, generator);
            }
            _ => MotionGeneratorMode::CartesianPosition,
        };
        (ControllerMode::JointImpedance, generator)
    }

    /// Runs the motion from the arm's present position; [`Signal::StandingPose`] first moves to its start.
    pub fn run(&self, robot: &mut Robot) -> Result<RobotState, FciError> {
        match self {
            Signal::StandingPose { from } => go_to(robot, from)?,
            Signal::FarEnd { .. } => robot.set_ee(&ee_moved_by(FAR_END_M))?,
            _ => {}
        }
        let ended = self.run_prepared(robot);
        if matches!(self, Signal::FarEnd { .. }) {
            robot.set_ee(&ee_moved_by(0.0))?;
        }
        ended
    }

    fn run_prepared(&self, robot: &mut Robot) -> Result<RobotState, FciError> {
        let (controller, generator) = self.generator(robot.version());
        let start = robot.read_state()?.clone();
        let mut clock = Clock::default();
        robot.control_unchecked(controller, generator, |state, step| {
            let ms = clock.tick(step);
            if let Signal::Unanswered { num } = self
                && (EVENT_MS..EVENT_MS + num).contains(&ms)
            {
                return Ok(None);
            }
            let motion = MotionCommand {
                q: start.q_desired,
                base_from_ee: start.base_from_ee_commanded,
                elbow: start.elbow_commanded,
                ..MotionCommand::default()
            };
            let mut command = RobotCommand { motion, ..RobotCommand::default() };
            let is_last = self.fill(&mut command, ms, state, &start);
            Ok(Some(answer(command, is_last)))
        })
    }

    /// Sets the command of the `ms`th cycle; returns true in the last.
    fn fill(&self, command: &mut RobotCommand, ms: u64, state: &RobotState, start: &RobotState) -> bool {
        let motion = &mut command.motion;
        // A profile starts later, because the first command of a motion has limits of its own, and because torques
        // replace the internal controller.
        let since_start = ms.checked_sub(PROFILE_START_MS);
        match self {
            Signal::Elbow { .. } if since_start.is_none() => motion.valid_elbow = true,
            Signal::Torque { .. } | Signal::SpunJoint { .. } if since_start.is_none() => {
                command.torque = holding_torque(state, start);
            }
            _ => {}
        }
        let is_profile = !matches!(
            self,
            Signal::StartPosition { .. }
                | Signal::StartPose { .. }
                | Signal::StartElbow { .. }
                | Signal::ElbowSign { .. }
                | Signal::Frame { .. }
                | Signal::StandingPose { .. }
                | Signal::Unanswered { .. }
        );
        let ms = match since_start {
            Some(since_start) if is_profile => since_start,
            None if is_profile => return false,
            _ => ms,
        };
        match self {
            Signal::JointPosition { joint, profile } => {
                motion.q[*joint] += profile.offset(ms);
                return profile.is_over(ms);
            }
            Signal::JointVelocity { joint, profile } => {
                motion.dq[*joint] = profile.value(ms);
                return profile.is_over(ms);
            }
            Signal::Pose { profile } => {
                let pose = isometry(&start.base_from_ee_commanded);
                let turn = nalgebra::UnitQuaternion::from_axis_angle(&nalgebra::Vector3::z_axis(), profile.offset(ms));
                let turned = nalgebra::Isometry3::from_parts(pose.translation, turn * pose.rotation);
                motion.base_from_ee = transform(&turned);
                return profile.is_over(ms);
            }
            Signal::Twist { profile } => {
                motion.twist[5] = profile.value(ms);
                return profile.is_over(ms);
            }
            Signal::PoseAlong { axis, profile } => {
                motion.base_from_ee[12 + *axis as usize] += profile.offset(ms);
                return profile.is_over(ms);
            }
            Signal::TwistAlong { axis, profile } => {
                motion.twist[*axis as usize] = profile.value(ms);
                return profile.is_over(ms);
            }
            Signal::FarEnd { profile } => {
                let [along_m, across_m] = JOINT_6_TO_FLANGE_M;
                motion.dq[5] = profile.value(ms) / (along_m + start.flange_from_ee[14]).hypot(across_m);
                return profile.is_over(ms);
            }
            Signal::Elbow { profile } => {
                motion.valid_elbow = true;
                motion.elbow[0] += profile.offset(ms);
                return profile.is_over(ms);
            }
            Signal::Torque { profile } => {
                command.torque = holding_torque(state, start);
                command.torque[6] = profile.value(ms);
                return profile.is_over(ms);
            }
            Signal::SpunJoint { profile } => {
                command.torque = holding_torque(state, start);
                command.torque[6] = within_rate(20.0 * (profile.value(ms) - state.dq[6]), state, 6).clamp(-11.0, 11.0);
                return profile.is_over(ms);
            }
            Signal::StartPosition { offset } => motion.q[0] += offset,
            Signal::StartPose { offset } => motion.base_from_ee[12] += offset,
            Signal::StartElbow { offset } => {
                motion.valid_elbow = true;
                motion.elbow[0] += offset;
            }
            Signal::ElbowSign { changes } => {
                motion.valid_elbow = true;
                if *changes && ms >= EVENT_MS {
                    motion.elbow[1] = -motion.elbow[1];
                }
            }
            Signal::Frame { scale } if ms >= EVENT_MS => {
                motion.base_from_ee[..12].iter_mut().for_each(|value| *value *= scale);
            }
            Signal::Frame { .. } | Signal::StandingPose { .. } | Signal::Unanswered { .. } => {}
        }
        ms >= STANDING_MS
    }
}

/// A frame of the end effector that is moved from the finger tips along its own z, m.
fn ee_moved_by(z_m: f64) -> Transform {
    transform(&nalgebra::Isometry3::translation(0.0, 0.0, z_m))
}

/// Springs and dampers that keep the joints at their start; joint 7 is free.
fn holding_torque(state: &RobotState, start: &RobotState) -> [f64; 7] {
    std::array::from_fn(|joint| {
        let spring = 60.0 * (start.q[joint] - state.q[joint]) - 6.0 * state.dq[joint];
        within_rate(if joint == 6 { 0.0 } else { spring }, state, joint)
    })
}

/// The torque nearest to `torque` within the rate limit from the last torque.
fn within_rate(torque: f64, state: &RobotState, joint: usize) -> f64 {
    let last = state.torque_desired[joint];
    torque.clamp(last - 0.9, last + 0.9)
}
