//! The robot's errors, by libfranka's names.

use std::fmt;

use crate::wire::codec::Codec;
use crate::wire_error::WireError;

/// Defines the errors in the order of their bits.
macro_rules! robot_errors {
    ($($(#[$doc:meta])* $variant:ident = $name:literal),+ $(,)?) => {
        /// The reason why the robot stopped a motion.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
        #[repr(u8)]
        pub enum RobotError {
            $($(#[$doc])* $variant,)+
        }

        impl RobotError {
            /// Every error, in the order of its bit.
            pub const ALL: [RobotError; NUM_ERRORS] = [$(RobotError::$variant,)+];

            /// libfranka's name.
            pub const fn name(self) -> &'static str {
                match self {
                    $(RobotError::$variant => $name,)+
                }
            }
        }
    };
}

/// Number of error flags in a state.
pub const NUM_ERRORS: usize = 41;

robot_errors! {
    /// A joint left its range.
    JointPositionLimitsViolation = "joint_position_limits_violation",
    /// The end effector left its workspace.
    CartesianPositionLimitsViolation = "cartesian_position_limits_violation",
    /// The arm would collide with itself.
    SelfCollisionAvoidanceViolation = "self_collision_avoidance_violation",
    /// A joint is too fast.
    JointVelocityViolation = "joint_velocity_violation",
    /// The end effector is too fast.
    CartesianVelocityViolation = "cartesian_velocity_violation",
    /// The force controller left its limits.
    ForceControlSafetyViolation = "force_control_safety_violation",
    /// The external torque on a joint exceeded its threshold.
    JointReflex = "joint_reflex",
    /// The external force exceeded its threshold.
    CartesianReflex = "cartesian_reflex",
    /// The goal pose was missed by more than the tolerance.
    MaxGoalPoseDeviationViolation = "max_goal_pose_deviation_violation",
    /// The path was missed by more than the tolerance.
    MaxPathPoseDeviationViolation = "max_path_pose_deviation_violation",
    /// The velocity along the path was not kept.
    CartesianVelocityProfileSafetyViolation = "cartesian_velocity_profile_safety_violation",
    /// The first position differs from the arm's position.
    JointPositionMotionGeneratorStartPoseInvalid = "joint_position_motion_generator_start_pose_invalid",
    /// A commanded position is out of range.
    JointMotionGeneratorPositionLimitsViolation = "joint_motion_generator_position_limits_violation",
    /// A commanded joint velocity is too large.
    JointMotionGeneratorVelocityLimitsViolation = "joint_motion_generator_velocity_limits_violation",
    /// The commanded velocity jumps: the acceleration is too large.
    JointMotionGeneratorVelocityDiscontinuity = "joint_motion_generator_velocity_discontinuity",
    /// The commanded acceleration jumps: the jerk, or with commanded velocities the acceleration, is too large.
    JointMotionGeneratorAccelerationDiscontinuity = "joint_motion_generator_acceleration_discontinuity",
    /// The first pose differs from the end effector's pose.
    CartesianPositionMotionGeneratorStartPoseInvalid = "cartesian_position_motion_generator_start_pose_invalid",
    /// The commanded elbow is out of range or too fast.
    CartesianMotionGeneratorElbowLimitViolation = "cartesian_motion_generator_elbow_limit_violation",
    /// The commanded twist is too large.
    CartesianMotionGeneratorVelocityLimitsViolation = "cartesian_motion_generator_velocity_limits_violation",
    /// The commanded twist jumps: the acceleration is too large.
    CartesianMotionGeneratorVelocityDiscontinuity = "cartesian_motion_generator_velocity_discontinuity",
    /// The commanded acceleration jumps: the jerk, or with commanded twists the acceleration, is too large.
    CartesianMotionGeneratorAccelerationDiscontinuity = "cartesian_motion_generator_acceleration_discontinuity",
    /// The sign of the elbow changed.
    CartesianMotionGeneratorElbowSignInconsistent = "cartesian_motion_generator_elbow_sign_inconsistent",
    /// The first elbow differs from the arm's elbow.
    CartesianMotionGeneratorStartElbowInvalid = "cartesian_motion_generator_start_elbow_invalid",
    /// The wanted force was not reached.
    ForceControllerDesiredForceToleranceViolation = "force_controller_desired_force_tolerance_violation",
    /// The sign of the first elbow differs from the arm's.
    StartElbowSignInconsistent = "start_elbow_sign_inconsistent",
    /// Twenty commands in a row were lost.
    CommunicationConstraintsViolation = "communication_constraints_violation",
    /// The motors needed too much power.
    PowerLimitViolation = "power_limit_violation",
    /// The pose requires a joint outside its range.
    CartesianMotionGeneratorJointPositionLimitsViolation = "cartesian_motion_generator_joint_position_limits_violation",
    /// The twist requires too large a velocity of a joint.
    CartesianMotionGeneratorJointVelocityLimitsViolation = "cartesian_motion_generator_joint_velocity_limits_violation",
    /// The pose requires too large an acceleration of a joint.
    CartesianMotionGeneratorJointVelocityDiscontinuity = "cartesian_motion_generator_joint_velocity_discontinuity",
    /// The pose requires too large a jerk of a joint, or the twist too large a jerk or acceleration.
    CartesianMotionGeneratorJointAccelerationDiscontinuity = "cartesian_motion_generator_joint_acceleration_discontinuity",
    /// The commanded pose is not a rotation and translation.
    CartesianPositionMotionGeneratorInvalidFrameFlag = "cartesian_position_motion_generator_invalid_frame_flag",
    /// The commanded torque jumps.
    ControllerTorqueDiscontinuity = "controller_torque_discontinuity",
    /// A point-to-point motion lacks torque.
    JointP2pInsufficientTorqueForPlanning = "joint_p2p_insufficient_torque_for_planning",
    /// A torque is out of range.
    TauJRangeViolation = "tau_J_range_violation",
    /// The controller oscillates.
    InstabilityDetected = "instability_detected",
    /// A joint beyond its range moved further out.
    JointMoveInWrongDirection = "joint_move_in_wrong_direction",
    /// A spline left its limits.
    CartesianSplineMotionGeneratorViolation = "cartesian_spline_motion_generator_violation",
    /// A motion through points left its limits.
    JointViaMotionGeneratorPlanningJointLimitViolation = "joint_via_motion_generator_planning_joint_limit_violation",
    /// The base's accelerometer did not start.
    BaseAccelerationInitializationTimeout = "base_acceleration_initialization_timeout",
    /// The base's accelerometer gave implausible values.
    BaseAccelerationInvalidReading = "base_acceleration_invalid_reading",
}

impl fmt::Display for RobotError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// A set of errors.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct RobotErrors(u64);

impl RobotErrors {
    /// Whether the set is empty.
    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// Whether it contains an error.
    pub const fn contains(self, error: RobotError) -> bool {
        self.0 >> error as u8 & 1 == 1
    }

    /// Adds an error.
    pub fn insert(&mut self, error: RobotError) {
        self.0 |= 1 << error as u8;
    }

    /// The errors, in the order of their bits.
    pub fn iter(self) -> impl Iterator<Item = RobotError> {
        RobotError::ALL.into_iter().filter(move |&error| self.contains(error))
    }

    pub(crate) fn field(&mut self, codec: &mut impl Codec) -> Result<(), WireError> {
        let mut flags: [u8; NUM_ERRORS] = std::array::from_fn(|bit| (self.0 >> bit & 1) as u8);
        codec.bytes(&mut flags)?;
        self.0 = flags.iter().enumerate().map(|(bit, &flag)| u64::from(flag != 0) << bit).sum();
        Ok(())
    }
}

impl From<RobotError> for RobotErrors {
    fn from(error: RobotError) -> Self {
        Self(1 << error as u8)
    }
}

impl FromIterator<RobotError> for RobotErrors {
    fn from_iter<T: IntoIterator<Item = RobotError>>(errors: T) -> Self {
        let mut set = Self::default();
        errors.into_iter().for_each(|error| set.insert(error));
        set
    }
}

impl fmt::Display for RobotErrors {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.is_empty() {
            return f.write_str("none");
        }
        for (index, error) in self.iter().enumerate() {
            write!(f, "{}{error}", if index == 0 { "" } else { ", " })?;
        }
        Ok(())
    }
}
