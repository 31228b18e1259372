//! Actions of control_msgs: FollowJointTrajectory and GripperCommand. The part common to all actions comes from
//! `ros2-client`.

use super::geometry::{Transform, Twist};
use super::{Header, structure};
use crate::cdr::{Cdr, CdrError, Reader, Writer};

structure! {
    /// `builtin_interfaces/msg/Duration`.
    Duration {
        /// Whole seconds.
        sec: i32,
        /// Nanoseconds.
        nanosec: u32,
    }
}

impl Copy for Duration {}

impl Duration {
    /// Converts from seconds, to the nanosecond; 0 for a negative value or NaN.
    pub fn from_secs(secs: f64) -> Self {
        let nanos = (secs.max(0.0) * 1e9).round().min(f64::from(i32::MAX) * 1e9) as u64;
        Self { sec: i32::try_from(nanos / 1_000_000_000).unwrap_or(i32::MAX), nanosec: (nanos % 1_000_000_000) as u32 }
    }

    /// The duration in seconds.
    pub fn secs(self) -> f64 {
        f64::from(self.sec) + f64::from(self.nanosec) * 1e-9
    }
}

/// A result as in `*_GetResult_Response`, where the one byte of the status precedes the result and shifts its
/// alignment.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct AfterStatus<T>(pub T);

impl<T: Cdr> Cdr for AfterStatus<T> {
    const MIN_BYTES: usize = T::MIN_BYTES;

    fn write(&self, to: &mut Writer) {
        to.shifted_by_one(&self.0);
    }

    fn read(from: &mut Reader<'_>) -> Result<Self, CdrError> {
        from.shifted_by_one().map(Self)
    }
}

structure! {
    /// `trajectory_msgs/msg/JointTrajectoryPoint`.
    JointTrajectoryPoint {
        /// Positions in rad, in the order of the trajectory's names.
        positions: Vec<f64>,
        /// Velocities in rad/s; may be empty.
        velocities: Vec<f64>,
        /// Accelerations in rad/s²; may be empty.
        accelerations: Vec<f64>,
        /// Torques in Nm; may be empty.
        effort: Vec<f64>,
        /// Time from the start of the trajectory.
        time_from_start: Duration,
    }
}

structure! {
    /// `trajectory_msgs/msg/JointTrajectory`.
    JointTrajectory {
        /// A stamp of 0 starts at once.
        header: Header,
        /// The moving joints.
        joint_names: Vec<String>,
        /// The points, in order of time.
        points: Vec<JointTrajectoryPoint>,
    }
}

structure! {
    /// `trajectory_msgs/msg/MultiDOFJointTrajectoryPoint`, not used here.
    MultiDofTrajectoryPoint {
        /// The transforms of the joints.
        transforms: Vec<Transform>,
        /// The velocities of the joints.
        velocities: Vec<Twist>,
        /// The accelerations of the joints.
        accelerations: Vec<Twist>,
        /// Time from the start of the trajectory.
        time_from_start: Duration,
    }
}

structure! {
    /// `trajectory_msgs/msg/MultiDOFJointTrajectory`, not used here.
    MultiDofTrajectory {
        /// Stamp and frame.
        header: Header,
        /// Names of the joints.
        joint_names: Vec<String>,
        /// The points, in order of time.
        points: Vec<MultiDofTrajectoryPoint>,
    }
}

structure! {
    /// `control_msgs/msg/JointTolerance`.
    JointTolerance {
        /// The joint.
        name: String,
        /// Tolerance of the position, rad.
        position: f64,
        /// Tolerance of the velocity, rad/s.
        velocity: f64,
        /// Tolerance of the acceleration, rad/s².
        acceleration: f64,
    }
}

structure! {
    /// `control_msgs/msg/JointComponentTolerance`.
    JointComponentTolerance {
        /// The joint.
        joint_name: String,
        /// The degree of freedom.
        component: u16,
        /// Tolerance of the position, rad or m.
        position: f64,
        /// Tolerance of the velocity.
        velocity: f64,
        /// Tolerance of the acceleration.
        acceleration: f64,
    }
}

structure! {
    /// `control_msgs/action/FollowJointTrajectory_Goal`.
    FollowJointTrajectoryGoal {
        /// The joint positions over time.
        trajectory: JointTrajectory,
        /// Always empty.
        multi_dof_trajectory: MultiDofTrajectory,
        /// Tolerances during the motion; if empty, the controller uses its own.
        path_tolerance: Vec<JointTolerance>,
        /// Always empty.
        component_path_tolerance: Vec<JointComponentTolerance>,
        /// Tolerances at the end.
        goal_tolerance: Vec<JointTolerance>,
        /// Always empty.
        component_goal_tolerance: Vec<JointComponentTolerance>,
        /// Largest delay of the end after the trajectory's time.
        goal_time_tolerance: Duration,
    }
}

structure! {
    /// `control_msgs/action/FollowJointTrajectory_Result`.
    FollowJointTrajectoryResult {
        /// Error code; 0 means success.
        error_code: i32,
        /// Description of the error.
        error_string: String,
    }
}

structure! {
    /// `control_msgs/action/FollowJointTrajectory_Feedback`; the further fields of a newer version are not read.
    FollowJointTrajectoryFeedback {
        /// Stamp and frame.
        header: Header,
        /// The joints.
        joint_names: Vec<String>,
        /// The desired positions.
        desired: JointTrajectoryPoint,
        /// The actual positions.
        actual: JointTrajectoryPoint,
        /// The difference.
        error: JointTrajectoryPoint,
    }
}

structure! {
    /// `control_msgs/action/GripperCommand_Goal`.
    GripperCommandGoal {
        /// The desired position of the gripper's joint, m.
        position: f64,
        /// The maximum force, N.
        max_effort: f64,
    }
}

structure! {
    /// `control_msgs/action/GripperCommand_Result`.
    GripperCommandResult {
        /// The position of the gripper's joint, m.
        position: f64,
        /// The force, N.
        effort: f64,
        /// Whether the gripper pushes without moving.
        stalled: bool,
        /// Whether the gripper reached its desired position.
        reached_goal: bool,
    }
}

structure! {
    /// `control_msgs/action/GripperCommand_Feedback`.
    GripperCommandFeedback {
        /// The position of the gripper's joint, m.
        position: f64,
        /// The force, N.
        effort: f64,
        /// Whether the gripper pushes without moving.
        stalled: bool,
        /// Whether the gripper reached its desired position.
        reached_goal: bool,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cdr::{from_bytes, to_bytes};

    #[test]
    fn a_result_behind_the_status_is_aligned_with_it() {
        let result = FollowJointTrajectoryResult { error_code: 7, error_string: "a".to_owned() };
        let bytes = to_bytes(&AfterStatus(result.clone()));
        // Computed by hand: the status would be byte 0, so that three bytes of padding precede the i32.
        assert_eq!(bytes, [0, 0, 0, 7, 0, 0, 0, 2, 0, 0, 0, b'a', 0]);
        assert_eq!(from_bytes::<AfterStatus<FollowJointTrajectoryResult>>(&bytes).unwrap().0, result);
    }

    #[test]
    fn durations_are_whole_nanoseconds() {
        assert_eq!(Duration::from_secs(1.25), Duration { sec: 1, nanosec: 250_000_000 });
        assert_eq!(Duration::from_secs(0.999_999_999_9), Duration { sec: 1, nanosec: 0 });
        assert_eq!(Duration::from_secs(-1.0), Duration::default());
        assert_eq!(Duration::from_secs(f64::NAN), Duration::default());
        assert!((Duration::from_secs(3.5).secs() - 3.5).abs() < 1e-12);
    }
}
