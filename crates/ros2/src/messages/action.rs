//! Actions of control_msgs: FollowJointTrajectory and GripperCommand. What all actions have in common comes from `ros2-client`.

use super::geometry::{Transform, Twist};
use super::{Header, structure};
use crate::cdr::{Cdr, CdrError, Reader, Writer};

structure! {
    /// `builtin_interfaces/msg/Duration`.
    Duration {
        /// Whole seconds.
        sec: i32,
        /// And nanoseconds.
        nanosec: u32,
    }
}

impl Copy for Duration {}

impl Duration {
    /// So many seconds, to the nanosecond; 0 for what is negative or no number.
    pub fn from_secs(secs: f64) -> Self {
        let nanos = (secs.max(0.0) * 1e9).round().min(f64::from(i32::MAX) * 1e9) as u64;
        Self { sec: i32::try_from(nanos / 1_000_000_000).unwrap_or(i32::MAX), nanosec: (nanos % 1_000_000_000) as u32 }
    }

    /// Seconds.
    pub fn secs(self) -> f64 {
        f64::from(self.sec) + f64::from(self.nanosec) * 1e-9
    }
}

/// A result as it stands in `*_GetResult_Response`: behind the status's one byte, by which its alignment is shifted.
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
        /// rad, in the order of the trajectory's names.
        positions: Vec<f64>,
        /// rad/s; may be empty.
        velocities: Vec<f64>,
        /// rad/s²; may be empty.
        accelerations: Vec<f64>,
        /// Nm; may be empty.
        effort: Vec<f64>,
        /// From the trajectory's start.
        time_from_start: Duration,
    }
}

structure! {
    /// `trajectory_msgs/msg/JointTrajectory`.
    JointTrajectory {
        /// A stamp of 0 starts at once.
        header: Header,
        /// The joints that move.
        joint_names: Vec<String>,
        /// In the order of time.
        points: Vec<JointTrajectoryPoint>,
    }
}

structure! {
    /// `trajectory_msgs/msg/MultiDOFJointTrajectoryPoint`, which nothing here fills in.
    MultiDofTrajectoryPoint {
        /// Of the frames.
        transforms: Vec<Transform>,
        /// Their velocities.
        velocities: Vec<Twist>,
        /// Their accelerations.
        accelerations: Vec<Twist>,
        /// From the trajectory's start.
        time_from_start: Duration,
    }
}

structure! {
    /// `trajectory_msgs/msg/MultiDOFJointTrajectory`, which nothing here fills in.
    MultiDofTrajectory {
        /// When.
        header: Header,
        /// Which joints.
        joint_names: Vec<String>,
        /// In the order of time.
        points: Vec<MultiDofTrajectoryPoint>,
    }
}

structure! {
    /// `control_msgs/msg/JointTolerance`.
    JointTolerance {
        /// The joint.
        name: String,
        /// rad.
        position: f64,
        /// rad/s.
        velocity: f64,
        /// rad/s².
        acceleration: f64,
    }
}

structure! {
    /// `control_msgs/msg/JointComponentTolerance`.
    JointComponentTolerance {
        /// The joint.
        joint_name: String,
        /// Which of its degrees of freedom.
        component: u16,
        /// rad or m.
        position: f64,
        /// And their rates.
        velocity: f64,
        /// And theirs.
        acceleration: f64,
    }
}

structure! {
    /// `control_msgs/action/FollowJointTrajectory_Goal`.
    FollowJointTrajectoryGoal {
        /// Where the joints are to be when.
        trajectory: JointTrajectory,
        /// Empty here.
        multi_dof_trajectory: MultiDofTrajectory,
        /// On the way; empty: the controller's own.
        path_tolerance: Vec<JointTolerance>,
        /// Empty here.
        component_path_tolerance: Vec<JointComponentTolerance>,
        /// At the end.
        goal_tolerance: Vec<JointTolerance>,
        /// Empty here.
        component_goal_tolerance: Vec<JointComponentTolerance>,
        /// How much later than the trajectory says the end may be reached.
        goal_time_tolerance: Duration,
    }
}

structure! {
    /// `control_msgs/action/FollowJointTrajectory_Result`.
    FollowJointTrajectoryResult {
        /// 0 is success.
        error_code: i32,
        /// In words.
        error_string: String,
    }
}

structure! {
    /// `control_msgs/action/FollowJointTrajectory_Feedback`; what follows the first three of a newer version is not read.
    FollowJointTrajectoryFeedback {
        /// When.
        header: Header,
        /// The joints.
        joint_names: Vec<String>,
        /// Where they are wanted.
        desired: JointTrajectoryPoint,
        /// Where they are.
        actual: JointTrajectoryPoint,
        /// The difference.
        error: JointTrajectoryPoint,
    }
}

structure! {
    /// `control_msgs/action/GripperCommand_Goal`.
    GripperCommandGoal {
        /// Where the gripper's joint is wanted, m.
        position: f64,
        /// N.
        max_effort: f64,
    }
}

structure! {
    /// `control_msgs/action/GripperCommand_Result`.
    GripperCommandResult {
        /// Where the gripper's joint is, m.
        position: f64,
        /// N.
        effort: f64,
        /// Whether it pushes and does not move.
        stalled: bool,
        /// Whether it is where it was wanted.
        reached_goal: bool,
    }
}

structure! {
    /// `control_msgs/action/GripperCommand_Feedback`.
    GripperCommandFeedback {
        /// Where the gripper's joint is, m.
        position: f64,
        /// N.
        effort: f64,
        /// Whether it pushes and does not move.
        stalled: bool,
        /// Whether it is where it was wanted.
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
        // By hand: the status would be byte 0, so three bytes of padding stand before the i32.
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
