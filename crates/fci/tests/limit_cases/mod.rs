//! One motion just inside and one just outside of every limit that a robot checks, by our client.
//!
//! Each motion leads one signal to its limit with all others well within theirs, at `1 - MARGIN` or `1 + MARGIN` of it.

mod profile;

use std::fmt;
use std::ops::ControlFlow;
use std::time::Duration;

use sdg_fci::client::{Answer, InternalController, Robot};
use sdg_fci::wire::{
    ControllerMode, MotionCommand, MotionGeneratorMode, RobotCommand, RobotMode, RobotState, Status, Version,
};
use sdg_fci::{FciError, Limits, RobotError, RobotErrors, isometry, transform};

use profile::Profile;

/// How far inside and outside, as a share of the limit.
const MARGIN: f64 = 0.005;
/// The robot stops for measured velocities this much beyond the limit, rad/s, or somewhat later.
const MEASURED_BEYOND: f64 = 0.4;

/// What a motion commands.
#[derive(Debug, Clone)]
enum Signal {
    /// A joint's position.
    JointPosition { joint: usize, profile: Profile },
    /// A joint's velocity.
    JointVelocity { joint: usize, profile: Profile },
    /// The turn of the end effector about the base's z.
    Pose { profile: Profile },
    /// The same as a velocity.
    Twist { profile: Profile },
    /// The elbow, the end effector standing.
    Elbow { profile: Profile },
    /// Joint 7's torque, the others standing.
    Torque { profile: Profile },
    /// Joint 7 brought to a velocity by torques.
    SpunJoint { profile: Profile },
    /// The first commanded position of joint 1 is this far off.
    StartPosition { offset: f64 },
    /// The first commanded pose is this far off along x.
    StartPose { offset: f64 },
    /// The first commanded elbow is this far off.
    StartElbow { offset: f64 },
    /// The elbow's sign changes after 20 cycles, or not.
    ElbowSign { changes: bool },
    /// The commanded pose is a rotation times this after 20 cycles.
    Frame { scale: f64 },
    /// So many answers in a row are left out.
    Unanswered { num: u64 },
}

/// A kind of check, with a motion on either side of it.
#[derive(Debug, Clone)]
pub struct Case {
    /// What is checked.
    pub name: &'static str,
    error: RobotError,
    inside: Signal,
    outside: Signal,
}

/// How a motion ended.
#[derive(Debug, Clone, PartialEq)]
pub enum Found {
    /// At its end.
    Done,
    /// By the robot, for these errors.
    Stopped(RobotErrors),
    /// In another way.
    Other(String),
}

impl fmt::Display for Found {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Found::Done => f.write_str("done"),
            Found::Stopped(errors) => write!(f, "stopped for {errors}"),
            Found::Other(what) => f.write_str(what),
        }
    }
}

/// Every kind of check.
pub fn all(limits: &Limits) -> Vec<Case> {
    let (inside, outside) = (1.0 - MARGIN, 1.0 + MARGIN);
    let case = |name, error, signal: &dyn Fn(f64) -> Signal| Case {
        name,
        error,
        inside: signal(inside),
        outside: signal(outside),
    };
    let (joint, turn, elbow) = (0, limits.rotation, limits.elbow);
    let (velocity, acceleration, jerk) = (limits.velocity[joint], limits.acceleration[joint], limits.jerk[joint]);
    let position = |profile| Signal::JointPosition { joint, profile };
    let speed = |profile| Signal::JointVelocity { joint, profile };
    // Joint 7 starts at 0.785 rad; near its end an FR3 allows little velocity, so that the inner motion ends earlier.
    let to_the_end = limits.q_max[6] - std::f64::consts::FRAC_PI_4;
    let torque = |peak: f64| {
        let up = (0..=20).map(|step| peak * f64::from(step) / 20.0);
        let pulse: Vec<f64> = up.clone().chain(up.rev()).collect();
        let back = pulse.clone().into_iter().map(|value| -value);
        Profile::of(pulse.into_iter().chain(back))
    };
    let torque_step = |rate: f64| Profile::of([rate * 1e-3, 0.0, -rate * 1e-3, 0.0].into_iter());
    let spun = |peak: f64| Signal::SpunJoint { profile: Profile::velocity(-peak, 150) };
    vec![
        Case {
            name: "joint position",
            error: RobotError::JointMotionGeneratorPositionLimitsViolation,
            inside: Signal::JointPosition { joint: 6, profile: Profile::distance(to_the_end - 0.02, 8000) },
            outside: Signal::JointPosition { joint: 6, profile: Profile::distance(to_the_end + 0.001, 8000) },
        },
        case("joint velocity, by positions", RobotError::JointMotionGeneratorVelocityLimitsViolation, &|share| {
            position(Profile::velocity_burst(velocity * share, 800, 0.4 * acceleration))
        }),
        case("joint acceleration, by positions", RobotError::JointMotionGeneratorVelocityDiscontinuity, &|share| {
            position(Profile::acceleration(acceleration * share))
        }),
        case("joint jerk, by positions", RobotError::JointMotionGeneratorAccelerationDiscontinuity, &|share| {
            position(Profile::jerk(jerk * share))
        }),
        case("joint velocity, by velocities", RobotError::JointMotionGeneratorVelocityLimitsViolation, &|share| {
            speed(Profile::velocity_burst(velocity * share, 800, 0.4 * acceleration))
        }),
        case(
            "joint acceleration, by velocities",
            RobotError::JointMotionGeneratorAccelerationDiscontinuity,
            &|share| speed(Profile::acceleration(acceleration * share)),
        ),
        case("joint jerk, by velocities", RobotError::JointMotionGeneratorAccelerationDiscontinuity, &|share| {
            speed(Profile::jerk(jerk * share))
        }),
        case("turning velocity, by poses", RobotError::CartesianMotionGeneratorVelocityLimitsViolation, &|share| {
            Signal::Pose { profile: Profile::velocity(-turn.velocity * share, 500) }
        }),
        case("turning acceleration, by poses", RobotError::CartesianMotionGeneratorVelocityDiscontinuity, &|share| {
            Signal::Pose { profile: Profile::acceleration(turn.acceleration * share) }
        }),
        case("turning jerk, by poses", RobotError::CartesianMotionGeneratorAccelerationDiscontinuity, &|share| {
            Signal::Pose { profile: Profile::jerk(turn.jerk * share) }
        }),
        case("turning velocity, by twists", RobotError::CartesianMotionGeneratorVelocityLimitsViolation, &|share| {
            Signal::Twist { profile: Profile::velocity(-turn.velocity * share, 500) }
        }),
        case(
            "turning acceleration, by twists",
            RobotError::CartesianMotionGeneratorAccelerationDiscontinuity,
            &|share| Signal::Twist { profile: Profile::acceleration(turn.acceleration * share) },
        ),
        case("turning jerk, by twists", RobotError::CartesianMotionGeneratorAccelerationDiscontinuity, &|share| {
            Signal::Twist { profile: Profile::jerk(turn.jerk * share) }
        }),
        case("elbow jerk", RobotError::CartesianMotionGeneratorElbowLimitViolation, &|share| Signal::Elbow {
            profile: Profile::jerk(elbow.jerk * share),
        }),
        case("torque", RobotError::TauJRangeViolation, &|share| Signal::Torque {
            profile: torque(limits.torque[6] * share),
        }),
        case("torque rate", RobotError::ControllerTorqueDiscontinuity, &|share| Signal::Torque {
            profile: torque_step(limits.torque_rate * share),
        }),
        Case {
            name: "measured joint velocity",
            error: RobotError::JointVelocityViolation,
            inside: spun(limits.velocity[6] * 0.95),
            outside: spun(limits.velocity[6] + MEASURED_BEYOND),
        },
        Case {
            name: "first position",
            error: RobotError::JointPositionMotionGeneratorStartPoseInvalid,
            // A step to a standing position jerks twice as much when it ends.
            inside: Signal::StartPosition { offset: 0.5 * jerk * 1e-9 * inside },
            outside: Signal::StartPosition { offset: 0.101 },
        },
        Case {
            name: "first pose",
            error: RobotError::CartesianPositionMotionGeneratorStartPoseInvalid,
            inside: Signal::StartPose { offset: 1e-9 },
            outside: Signal::StartPose { offset: 0.051 },
        },
        Case {
            name: "first elbow",
            error: RobotError::CartesianMotionGeneratorStartElbowInvalid,
            inside: Signal::StartElbow { offset: 0.5 * elbow.jerk * 1e-9 * inside },
            outside: Signal::StartElbow { offset: 0.101 },
        },
        Case {
            name: "elbow's side",
            error: RobotError::CartesianMotionGeneratorElbowSignInconsistent,
            inside: Signal::ElbowSign { changes: false },
            outside: Signal::ElbowSign { changes: true },
        },
        Case {
            name: "frame",
            error: RobotError::CartesianPositionMotionGeneratorInvalidFrameFlag,
            inside: Signal::Frame { scale: 1.0 + 0.9e-5 },
            outside: Signal::Frame { scale: 1.0 + 1.1e-5 },
        },
        Case {
            name: "unanswered states",
            error: RobotError::CommunicationConstraintsViolation,
            inside: Signal::Unanswered { num: 19 },
            outside: Signal::Unanswered { num: 20 },
        },
    ]
}

impl Case {
    /// Whether poses, twists or the elbow are commanded. A robot may stop such a motion inside of its Cartesian limits for what
    /// it needs of the joints, so that the two are told apart only where the joints are allowed more.
    #[allow(dead_code, reason = "franka-sim is told to allow the joints more")]
    pub fn is_cartesian(&self) -> bool {
        matches!(
            self.inside,
            Signal::Pose { .. } | Signal::Twist { .. } | Signal::Elbow { .. } | Signal::StartElbow { .. }
        )
    }

    /// Whether a motion ended as it should.
    pub fn is_expected(&self, is_inside: bool, found: &Found) -> bool {
        match found {
            Found::Done => is_inside,
            Found::Stopped(errors) => !is_inside && errors.contains(self.error),
            Found::Other(_) => false,
        }
    }

    /// Runs one of the two motions from `home`, rad, and recovers from its error.
    ///
    /// # Errors
    /// Those of the connection.
    pub fn run(&self, robot: &mut Robot, home: &[f64; 7], is_inside: bool) -> Result<Found, FciError> {
        go_to(robot, home)?;
        let signal = if is_inside { &self.inside } else { &self.outside };
        let found = match signal.run(robot) {
            Ok(_) => Found::Done,
            Err(FciError::Motion { status: Status::ReflexAborted, errors, .. }) => Found::Stopped(errors),
            Err(error @ (FciError::Motion { .. } | FciError::Refused { .. })) => Found::Other(error.to_string()),
            Err(error) => return Err(error),
        };
        if robot.read_state()?.robot_mode == RobotMode::Reflex {
            robot.automatic_error_recovery()?;
        }
        Ok(found)
    }
}

/// Moves the joints at leisure.
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

/// Milliseconds of the robot since the first state of a motion.
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

/// How long motions last that command no profile.
const STANDING_MS: u64 = 100;
/// Profiles begin after so many cycles of standing.
const PROFILE_START_MS: u64 = 30;
/// When those do what they are made for.
const EVENT_MS: u64 = 20;

impl Signal {
    fn generator(&self, version: Version) -> (ControllerMode, MotionGeneratorMode) {
        let generator = match self {
            Signal::JointPosition { .. } | Signal::StartPosition { .. } | Signal::Unanswered { .. } => {
                MotionGeneratorMode::JointPosition
            }
            Signal::JointVelocity { .. } => MotionGeneratorMode::JointVelocity,
            Signal::Twist { .. } => MotionGeneratorMode::CartesianVelocity,
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

    fn run(&self, robot: &mut Robot) -> Result<RobotState, FciError> {
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

    /// Sets what is commanded in the `ms`th cycle; true in the last.
    fn fill(&self, command: &mut RobotCommand, ms: u64, state: &RobotState, start: &RobotState) -> bool {
        let motion = &mut command.motion;
        // The first command of a motion is judged by other rules, and torques take over from the internal controller.
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
            Signal::Frame { .. } | Signal::Unanswered { .. } => {}
        }
        ms >= STANDING_MS
    }
}

/// Springs and dampers that keep the joints where they started; joint 7 is let go.
fn holding_torque(state: &RobotState, start: &RobotState) -> [f64; 7] {
    std::array::from_fn(|joint| {
        let spring = 60.0 * (start.q[joint] - state.q[joint]) - 6.0 * state.dq[joint];
        within_rate(if joint == 6 { 0.0 } else { spring }, state, joint)
    })
}

/// A torque that is reached from the last one within the torque's rate.
fn within_rate(torque: f64, state: &RobotState, joint: usize) -> f64 {
    let last = state.torque_desired[joint];
    torque.clamp(last - 0.9, last + 0.9)
}
