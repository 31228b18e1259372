//! One motion just inside and one just outside of each tested limit of a robot, with this crate's client.
//!
//! Most motions move one signal to `1 - MARGIN` or `1 + MARGIN` of its limit, while all other signals stay well within
//! their limits.

mod profile;
mod signal;

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};
use std::fmt;

use sdg_fci::client::Robot;
use sdg_fci::wire::{RobotMode, Status};
use sdg_fci::{FciError, Limits, RobotError, RobotErrors};

use profile::Profile;
pub use signal::go_to;
use signal::{Axis, Signal};

/// Distance from the limit, inside and outside, as a fraction of the limit.
const MARGIN: f64 = 0.005;
/// Excess over the limit of a measured joint velocity in the motion outside, rad/s: the robot must stop that motion.
const MEASURED_BEYOND: f64 = 0.4;
/// Margin for measured velocities of the end effector, m/s: they overshoot the commanded ones, and a robot may tolerate
/// them up to 0.1 m/s above the limit.
const MEASURED_END_MARGIN: f64 = 0.1;
/// The usual start configuration of a Panda, rad.
pub const READY: [f64; 7] = [0.0, -FRAC_PI_4, 0.0, -3.0 * FRAC_PI_4, 0.0, FRAC_PI_2, FRAC_PI_4];
/// Rotation of joint 2 per metre forward at the ready pose, in the smallest joint motion (least squares), rad/m: an
/// entry of the Jacobian's pseudoinverse. No other joint comes as close to its limits in this motion.
const JOINT_2_PER_METRE: f64 = 3.1520;
/// A configuration just far enough from a singular one for the start of a Cartesian motion, rad: the smallest singular
/// value of the end effector's Jacobian is 0.053, and 0.048 at [`SINGULAR`], both at the flange and at the finger tips.
/// The required minimum is 0.05.
const BESIDE_SINGULAR: [f64; 7] = [0.0000, -0.2081, 0.0000, -0.8449, 0.0000, 1.3718, std::f64::consts::FRAC_PI_4];
const SINGULAR: [f64; 7] = [0.0000, -0.1924, 0.0000, -0.8038, 0.0000, 1.3663, std::f64::consts::FRAC_PI_4];
/// Joints 4 and 6 of an arm in self-collision, rad.
const FOLDED: (f64, f64) = (-3.0, 0.8);
/// The motion inside ends this far before the pose of the stop, as a fraction of the path to the folded pose.
const FOLD_MARGIN: f64 = 0.02;

/// A limit, with one motion inside and one outside.
#[derive(Debug, Clone)]
pub struct Case {
    /// The checked limit.
    pub name: &'static str,
    reason: Reason,
    inside: Signal,
    outside: Signal,
}

/// The robot's reaction to a motion outside.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Reason {
    /// The robot stops because of this error.
    Stop(RobotError),
    /// The robot does not start the motion.
    Refusal(Status),
}

/// The end of a motion.
#[derive(Debug, Clone, PartialEq)]
pub enum Found {
    /// The motion reached its end.
    Done,
    /// The robot stopped the motion because of these errors.
    Stopped(RobotErrors),
    /// The robot refused to start the motion.
    Refused(Status),
    /// The motion ended in another way.
    Other(String),
}

impl fmt::Display for Found {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Found::Done => f.write_str("done"),
            Found::Stopped(errors) => write!(f, "stopped for {errors}"),
            Found::Refused(status) => write!(f, "refused: {status}"),
            Found::Other(what) => f.write_str(what),
        }
    }
}

/// The cases, except those of [`joints_of_cartesian_motions`] and [`fold`].
pub fn all(limits: &Limits) -> Vec<Case> {
    let (inside, outside) = (1.0 - MARGIN, 1.0 + MARGIN);
    let case = |name, error, signal: &dyn Fn(f64) -> Signal| Case {
        name,
        reason: Reason::Stop(error),
        inside: signal(inside),
        outside: signal(outside),
    };
    let (joint, turn, elbow) = (0, limits.rotation, limits.elbow);
    let (velocity, acceleration, jerk) = (limits.velocity[joint], limits.acceleration[joint], limits.jerk[joint]);
    let position = |profile| Signal::JointPosition { joint, profile };
    let speed = |profile| Signal::JointVelocity { joint, profile };
    // Joint 7 starts at 0.785 rad; near the end of its range an FR3 allows only a low velocity, so that the motion
    // inside ends earlier.
    let to_the_end = limits.q_max[6] - FRAC_PI_4;
    let torque = |peak: f64| {
        let up = (0..=20).map(|step| peak * f64::from(step) / 20.0);
        let pulse: Vec<f64> = up.clone().chain(up.rev()).collect();
        let back = pulse.clone().into_iter().map(|value| -value);
        Profile::of(pulse.into_iter().chain(back))
    };
    let torque_step = |rate: f64| Profile::of([rate * 1e-3, 0.0, -rate * 1e-3, 0.0].into_iter());
    let spun = |peak: f64| Signal::SpunJoint { profile: Profile::velocity(-peak, 400) };
    let far_end = |speed: f64| Signal::FarEnd { profile: Profile::velocity(speed, 500) };
    vec![
        Case {
            name: "joint position",
            reason: Reason::Stop(RobotError::JointMotionGeneratorPositionLimitsViolation),
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
        case("angular velocity, by poses", RobotError::CartesianMotionGeneratorVelocityLimitsViolation, &|share| {
            Signal::Pose { profile: Profile::velocity(-turn.velocity * share, 500) }
        }),
        case("angular acceleration, by poses", RobotError::CartesianMotionGeneratorVelocityDiscontinuity, &|share| {
            Signal::Pose { profile: Profile::acceleration(turn.acceleration * share) }
        }),
        case("angular jerk, by poses", RobotError::CartesianMotionGeneratorAccelerationDiscontinuity, &|share| {
            Signal::Pose { profile: Profile::jerk(turn.jerk * share) }
        }),
        case("angular velocity, by twists", RobotError::CartesianMotionGeneratorVelocityLimitsViolation, &|share| {
            Signal::Twist { profile: Profile::velocity(-turn.velocity * share, 500) }
        }),
        case(
            "angular acceleration, by twists",
            RobotError::CartesianMotionGeneratorAccelerationDiscontinuity,
            &|share| Signal::Twist { profile: Profile::acceleration(turn.acceleration * share) },
        ),
        case("angular jerk, by twists", RobotError::CartesianMotionGeneratorAccelerationDiscontinuity, &|share| {
            Signal::Twist { profile: Profile::jerk(turn.jerk * share) }
        }),
        case("translation jerk, by poses", RobotError::CartesianMotionGeneratorAccelerationDiscontinuity, &|share| {
            Signal::PoseAlong { axis: Axis::Y, profile: Profile::jerk(limits.translation.jerk * share) }
        }),
        case("translation jerk, by twists", RobotError::CartesianMotionGeneratorAccelerationDiscontinuity, &|share| {
            Signal::TwistAlong { axis: Axis::Y, profile: Profile::jerk(limits.translation.jerk * share) }
        }),
        case(
            "translation acceleration, by poses",
            RobotError::CartesianMotionGeneratorVelocityDiscontinuity,
            &|share| Signal::PoseAlong {
                axis: Axis::Y,
                profile: Profile::acceleration(limits.translation.acceleration * share),
            },
        ),
        case(
            "translation acceleration, by twists",
            RobotError::CartesianMotionGeneratorAccelerationDiscontinuity,
            &|share| Signal::TwistAlong {
                axis: Axis::Y,
                profile: Profile::acceleration(limits.translation.acceleration * share),
            },
        ),
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
            reason: Reason::Stop(RobotError::JointVelocityViolation),
            inside: spun(limits.velocity[6] * 0.95),
            outside: spun(limits.velocity[6] + MEASURED_BEYOND),
        },
        Case {
            name: "measured velocity of the end effector",
            reason: Reason::Stop(RobotError::CartesianVelocityViolation),
            inside: far_end(limits.translation.velocity - MEASURED_END_MARGIN),
            outside: far_end(limits.translation.velocity + 2.0 * MEASURED_END_MARGIN),
        },
        Case {
            name: "start at a singular pose",
            reason: Reason::Refusal(Status::StartAtSingularPose),
            inside: Signal::StandingPose { from: BESIDE_SINGULAR },
            outside: Signal::StandingPose { from: SINGULAR },
        },
        Case {
            name: "first position",
            reason: Reason::Stop(RobotError::JointPositionMotionGeneratorStartPoseInvalid),
            // At the end of a step to a constant position, the jerk is twice that at the start of the step.
            inside: Signal::StartPosition { offset: 0.5 * jerk * 1e-9 * inside },
            outside: Signal::StartPosition { offset: 0.101 },
        },
        Case {
            name: "first pose",
            reason: Reason::Stop(RobotError::CartesianPositionMotionGeneratorStartPoseInvalid),
            inside: Signal::StartPose { offset: 1e-9 },
            outside: Signal::StartPose { offset: 0.051 },
        },
        Case {
            name: "first elbow",
            reason: Reason::Stop(RobotError::CartesianMotionGeneratorStartElbowInvalid),
            inside: Signal::StartElbow { offset: 0.5 * elbow.jerk * 1e-9 * inside },
            outside: Signal::StartElbow { offset: 0.101 },
        },
        Case {
            name: "sign of the elbow",
            reason: Reason::Stop(RobotError::CartesianMotionGeneratorElbowSignInconsistent),
            inside: Signal::ElbowSign { changes: false },
            outside: Signal::ElbowSign { changes: true },
        },
        Case {
            name: "frame",
            reason: Reason::Stop(RobotError::CartesianPositionMotionGeneratorInvalidFrameFlag),
            inside: Signal::Frame { scale: 1.0 + 0.9e-5 },
            outside: Signal::Frame { scale: 1.0 + 1.1e-5 },
        },
        Case {
            name: "unanswered states",
            reason: Reason::Stop(RobotError::CommunicationConstraintsViolation),
            inside: Signal::Unanswered { num: 19 },
            outside: Signal::Unanswered { num: 20 },
        },
    ]
}

/// Joint limits in Cartesian motions far from the Cartesian limits, along the base's x, from [`READY`]. Franka's robots
/// stop if these joint limits are violated: a Panda stops at 2.5 m/s², because joint 2 would need 7.9 rad/s² and its
/// limit is 7.5.
pub fn joints_of_cartesian_motions(limits: &Limits) -> Vec<Case> {
    let (inside, outside) = (1.0 - MARGIN, 1.0 + MARGIN);
    let acceleration = limits.acceleration[1] / JOINT_2_PER_METRE;
    let jerk = limits.jerk[1] / JOINT_2_PER_METRE;
    let case = |name, error, signal: &dyn Fn(f64) -> Signal| Case {
        name,
        reason: Reason::Stop(error),
        inside: signal(inside),
        outside: signal(outside),
    };
    let axis = Axis::X;
    vec![
        case(
            "joint acceleration, by poses",
            RobotError::CartesianMotionGeneratorJointVelocityDiscontinuity,
            &|share| Signal::PoseAlong { axis, profile: Profile::acceleration(acceleration * share) },
        ),
        case("joint jerk, by poses", RobotError::CartesianMotionGeneratorJointAccelerationDiscontinuity, &|share| {
            Signal::PoseAlong { axis, profile: Profile::jerk(jerk * share) }
        }),
        case(
            "joint acceleration, by twists",
            RobotError::CartesianMotionGeneratorJointAccelerationDiscontinuity,
            &|share| Signal::TwistAlong { axis, profile: Profile::acceleration(acceleration * share) },
        ),
        case("joint jerk, by twists", RobotError::CartesianMotionGeneratorJointAccelerationDiscontinuity, &|share| {
            Signal::TwistAlong { axis, profile: Profile::jerk(jerk * share) }
        }),
    ]
}

/// Folds the arm from `home`, rad, until the robot stops it before a self-collision, then moves it to just before that
/// pose. Returns the results of the motion just inside and of the motion outside.
///
/// # Errors
/// Errors of the connection.
#[allow(dead_code, reason = "the server of this crate has its own test")]
pub fn fold(robot: &mut Robot, home: &[f64; 7]) -> Result<[Found; 2], FciError> {
    let mut folded = *home;
    (folded[3], folded[5]) = FOLDED;
    go_to(robot, home)?;
    let outside = found(go_to(robot, &folded))?;
    let stopped = robot.read_state()?.q;
    recover(robot)?;
    go_to(robot, home)?;
    let share = (stopped[3] - home[3]) / (folded[3] - home[3]) - FOLD_MARGIN;
    let inside =
        found(go_to(robot, &std::array::from_fn(|joint| home[joint] + share * (folded[joint] - home[joint]))))?;
    recover(robot)?;
    go_to(robot, home)?;
    Ok([inside, outside])
}

fn found<T>(ended: Result<T, FciError>) -> Result<Found, FciError> {
    match ended {
        Ok(_) => Ok(Found::Done),
        Err(FciError::Motion { status: Status::ReflexAborted, errors, .. }) => Ok(Found::Stopped(errors)),
        Err(FciError::Refused { status, .. }) => Ok(Found::Refused(status)),
        // A robot that checks the start in the cycle after it accepted the Move sends the refusal as a second answer.
        Err(FciError::Motion { status: status @ Status::StartAtSingularPose, .. }) => Ok(Found::Refused(status)),
        Err(error @ FciError::Motion { .. }) => Ok(Found::Other(error.to_string())),
        Err(error) => Err(error),
    }
}

fn recover(robot: &mut Robot) -> Result<(), FciError> {
    if robot.read_state()?.robot_mode == RobotMode::Reflex {
        robot.automatic_error_recovery()?;
    }
    Ok(())
}

impl Case {
    /// Whether the arm moves by commanded poses, twists or elbow positions. A robot may stop such a motion inside its
    /// Cartesian limits because of its joint limits; the Cartesian limits can be tested alone only if the joint limits
    /// are higher.
    #[allow(dead_code, reason = "only used with franka-sim, whose joint limits are widened")]
    pub fn is_cartesian(&self) -> bool {
        matches!(
            self.inside,
            Signal::Pose { .. }
                | Signal::PoseAlong { .. }
                | Signal::Twist { .. }
                | Signal::TwistAlong { .. }
                | Signal::Elbow { .. }
                | Signal::StartElbow { .. }
        )
    }

    /// Whether a motion ended as expected.
    pub fn is_expected(&self, is_inside: bool, found: &Found) -> bool {
        match found {
            Found::Done => is_inside,
            Found::Stopped(errors) => {
                !is_inside && matches!(self.reason, Reason::Stop(error) if errors.contains(error))
            }
            Found::Refused(status) => !is_inside && self.reason == Reason::Refusal(*status),
            Found::Other(_) => false,
        }
    }

    /// Runs one of the two motions from `home`, rad, and recovers from its error.
    ///
    /// # Errors
    /// Errors of the connection.
    pub fn run(&self, robot: &mut Robot, home: &[f64; 7], is_inside: bool) -> Result<Found, FciError> {
        go_to(robot, home)?;
        let signal = if is_inside { &self.inside } else { &self.outside };
        let found = found(signal.run(robot))?;
        recover(robot)?;
        Ok(found)
    }
}
