//! An arm that is controlled over ROS 2: motions by FollowJointTrajectory, the hand by GripperCommand, states from
//! joint_states.
//!
//! ```text
//! CheckedMotion ─ sampled at 100 Hz ─ FollowJointTrajectory ─► ros2_control's joint_trajectory_controller
//! Watch ◄─ ArmState ─ joint_states                 cancelled when Watch asks to stop
//! HandCommand ─ GripperCommand ─► gripper_action_controller
//! ```
//! The real arm must have the given geometry. The arm's driver determines contact thresholds and loads. This crate
//! never recovers the arm.

use std::time::{Duration, Instant};

use sdg_robot::{
    Arm, ArmGeometry, ArmMode, ArmState, CheckedMotion, ContactSensitivity, HandCommand, HandState, Load,
    MAX_WIDTH_CHANGE_M, MIN_HELD_WIDTH_M, MotionEnd, RobotError, StopReason, Violation, Watch,
};

use super::action::{ActionClient, ActionType, Goal, GoalEnd};
use super::joint_states::{ArmConfig, Joints, Known, StateReader};
use super::node::Node;
use super::topic::Qos;
use crate::error::RosError;
use crate::messages::{
    FollowJointTrajectoryFeedback, FollowJointTrajectoryGoal, FollowJointTrajectoryResult, GripperCommandFeedback,
    GripperCommandGoal, GripperCommandResult, Header, JointTrajectory, JointTrajectoryPoint,
};

type Result<T> = sdg_robot::Result<T>;

/// Time between two points of a trajectory, s, so short that the controller's splines match the motion.
const POINT_SECS: f64 = 0.01;
/// Timeout of the action servers' answers.
const ANSWER: Duration = Duration::from_secs(5);
/// Delay after the planned end after which a motion counts as failed, s.
const MAX_DELAY_SECS: f64 = 5.0;
/// Timeout of a hand motion.
const MAX_HAND: Duration = Duration::from_secs(15);
/// Time without joint states, or with the same stamp in all of them, after which the driver counts as disconnected.
const MAX_STATE_AGE: Duration = Duration::from_millis(500);
/// Largest gap between two states of a moving arm, s: drivers publish 20 to 1000 states per second, and networks delay
/// them.
const MAX_SILENCE_SECS: f64 = 0.5;
/// Largest distance of a motion's start from the measured position, rad: above the deviations that controllers accept at
/// the end of a motion. From farther away the controller would jump to the start.
const MAX_START_DISTANCE_RAD: f64 = 0.05;
/// Interval of checks while hand or arm moves.
const POLL_INTERVAL: Duration = Duration::from_millis(5);
/// Maximum number of feedback messages taken between two checks.
const MAX_FEEDBACK: usize = 64;

/// An arm that is controlled over ROS 2.
pub struct TrajectoryArm {
    states: StateReader,
    motions: ActionClient<FollowJointTrajectoryGoal, FollowJointTrajectoryResult, FollowJointTrajectoryFeedback>,
    gripper: ActionClient<GripperCommandGoal, GripperCommandResult, GripperCommandFeedback>,
    config: ArmConfig,
    /// The end of the last motion, which the controller holds even if the measured position differs.
    commanded: Option<Joints>,
    hand: Option<(HandCommand, Goal)>,
    /// Opening with which the last command grasped an object, m.
    grasped_m: Option<f64>,
    num_feedback: u64,
}

impl TrajectoryArm {
    /// Waits for the arm's topic and actions.
    ///
    /// # Errors
    /// [`RobotError::Unreachable`] for a topic or action that does not answer.
    pub fn connect(node: &mut Node, config: ArmConfig, timeout: Duration) -> Result<Self> {
        let unreachable =
            |error: RosError| RobotError::Unreachable { peer: "the arm on ROS 2".to_owned(), why: error.to_string() };
        let sensors = Qos { depth: 20, ..Qos::SENSORS };
        let states = node.subscribe(&config.joint_states, sensors).map_err(unreachable)?;
        let follow = ActionType { package: "control_msgs", name: "FollowJointTrajectory" };
        let grip = ActionType { package: "control_msgs", name: "GripperCommand" };
        let motions = node.action_client(&config.trajectory_action, follow).map_err(unreachable)?;
        let gripper = node.action_client(&config.gripper_action, grip).map_err(unreachable)?;
        node.wait_for_server(&motions, timeout).map_err(unreachable)?;
        node.wait_for_server(&gripper, timeout).map_err(unreachable)?;
        let states = StateReader::spawn(states, &config).map_err(unreachable)?;
        let arm =
            Self { states, motions, gripper, config, commanded: None, hand: None, grasped_m: None, num_feedback: 0 };
        let deadline = Instant::now() + timeout;
        while arm.states.latest().is_none() {
            if Instant::now() > deadline {
                let joints = arm.config.joints.join(", ");
                let why = format!("expected the joints {joints} on {}, found none of them", arm.states.topic);
                return Err(RobotError::Unreachable { peer: "the arm on ROS 2".to_owned(), why });
            }
            std::thread::sleep(POLL_INTERVAL);
        }
        Ok(arm)
    }

    /// Number of feedback messages received with motions.
    pub fn num_feedback(&self) -> u64 {
        self.num_feedback
    }

    /// Forgets the end of the last motion, so that the next motion starts at the measured position: since then another
    /// client or a person may have moved the arm.
    pub fn forget_reference(&mut self) {
        self.commanded = None;
    }

    fn lost(&self, why: impl ToString) -> RobotError {
        RobotError::Lost { peer: "the arm on ROS 2".to_owned(), why: why.to_string() }
    }

    fn known(&self) -> Result<Known> {
        let known = self.states.latest().ok_or_else(|| self.lost("no joint states"))?;
        let age = known.arrived.elapsed();
        if age > MAX_STATE_AGE {
            let topic = &self.states.topic;
            let secs = age.as_secs_f64();
            return Err(self.lost(format!("no joint states on {topic} with a new stamp for {secs:.1} s")));
        }
        Ok(known)
    }

    fn arm_state(&self, mode: ArmMode) -> Result<ArmState> {
        let known = self.known()?;
        Ok(ArmState {
            time_secs: known.stamp_secs,
            q: known.q,
            dq: known.dq,
            q_commanded: self.commanded.unwrap_or(known.q),
            tau_external_nm: Joints::zeros(),
            mode,
        })
    }

    /// Passes a new state to `watch` and returns the watch's reason to stop the arm.
    fn observe(&self, watch: &mut Watch, seen_secs: &mut f64) -> Result<Option<StopReason>> {
        let state = self.arm_state(ArmMode::Moving)?;
        if state.time_secs == *seen_secs {
            return Ok(watch.is_stop_requested());
        }
        *seen_secs = state.time_secs;
        Ok(watch.observe(&state).cloned())
    }

    /// Waits for the end of a motion of the arm, or for a reason to cancel it.
    fn motion_end(
        &mut self,
        goal: &mut Goal,
        deadline: Instant,
        watch: &mut Watch,
    ) -> Result<(GoalEnd, FollowJointTrajectoryResult)> {
        let mut seen_secs = f64::NAN;
        loop {
            if let Some(ended) = self.motions.result(goal, POLL_INTERVAL).map_err(|error| self.lost(error))? {
                return Ok(ended);
            }
            // Bounded, so that a flood of feedback does not delay the checks below.
            for _ in 0..MAX_FEEDBACK {
                let Ok(Some(_)) = self.motions.feedback(goal, Duration::ZERO) else { break };
                self.num_feedback += 1;
            }
            if let Some(reason) = self.observe(watch, &mut seen_secs)? {
                return Err(RobotError::Stopped(reason));
            }
            if Instant::now() > deadline {
                let why = format!("the motion did not end {MAX_DELAY_SECS:.0} s after its time");
                return Err(RobotError::Stopped(StopReason::Watchdog(why)));
            }
        }
    }

    /// Waits for the end of a motion of the hand, or for a reason to cancel it.
    fn hand_end(&self, mut goal: Goal, watch: &mut Watch) -> Result<(GoalEnd, GripperCommandResult)> {
        watch.allow_silence(MAX_SILENCE_SECS);
        let deadline = Instant::now() + MAX_HAND;
        let mut seen_secs = f64::NAN;
        loop {
            let ended = self.gripper.result(&mut goal, POLL_INTERVAL);
            if let Some(ended) = ended.map_err(|error| RobotError::Hand(error.to_string()))? {
                return Ok(ended);
            }
            if let Some(reason) = self.observe(watch, &mut seen_secs)? {
                return Err(RobotError::Stopped(reason));
            }
            if Instant::now() > deadline {
                let secs = MAX_HAND.as_secs();
                return Err(RobotError::Hand(format!("{} did not end within {secs} s", self.gripper.name())));
            }
        }
    }

    /// Sends a motion and waits for its end.
    fn follow_to_end(&mut self, motion: &CheckedMotion, watch: &mut Watch) -> Result<MotionEnd> {
        check_start(motion.start(), &self.known()?.q)?;
        let goal =
            FollowJointTrajectoryGoal { trajectory: trajectory(motion, &self.config.joints), ..Default::default() };
        let sent = self.motions.send(goal, ANSWER).map_err(|error| self.lost(error))?;
        let Some(mut goal) = sent else {
            let action = self.motions.name();
            return Err(RobotError::Device(format!("{action} refused the trajectory").into()));
        };
        self.forget_reference();
        let deadline = Instant::now() + Duration::from_secs_f64(motion.duration_secs() + MAX_DELAY_SECS);
        let (end, result) = match self.motion_end(&mut goal, deadline, watch) {
            Ok(ended) => ended,
            Err(error) => {
                // The motion must not continue without being observed.
                let cancelled = self.cancel(&mut goal);
                return Err(with_failed_stop(error, cancelled));
            }
        };
        let said = format!("{}: {} {}", self.motions.name(), error_name(result.error_code), result.error_string);
        match end {
            GoalEnd::Succeeded if result.error_code == 0 => {
                self.commanded = Some(*motion.end());
                Ok(MotionEnd::Arrived)
            }
            GoalEnd::Succeeded | GoalEnd::Aborted => Err(RobotError::Reflex(said.trim_end().to_owned())),
            GoalEnd::Cancelled => Err(RobotError::Stopped(StopReason::Interrupted)),
            GoalEnd::Unknown => {
                Err(self.lost(format!("{} no longer knows the motion: was it restarted?", self.motions.name())))
            }
        }
    }

    fn wait_to_end(&self, duration_secs: f64, watch: &mut Watch) -> Result<()> {
        let deadline = Instant::now() + Duration::from_secs_f64(duration_secs.max(0.0));
        let mut seen_secs = f64::NAN;
        while Instant::now() < deadline {
            if let Some(reason) = self.observe(watch, &mut seen_secs)? {
                return Err(RobotError::Stopped(reason));
            }
            std::thread::sleep(POLL_INTERVAL);
        }
        Ok(())
    }

    /// Stops the hand after an error of the arm: its command runs in parallel with the arm's motion.
    fn with_hand_stopped<T>(&mut self, ended: Result<T>) -> Result<T> {
        match ended {
            Err(error) if error.latches() => {
                let stopped = self.stop();
                Err(with_failed_stop(error, stopped))
            }
            ended => ended,
        }
    }

    fn cancel(&mut self, goal: &mut Goal) -> Result<()> {
        let ended = self.motions.cancel(goal, ANSWER).and_then(|_| self.motions.result(goal, ANSWER));
        check_cancelled(ended, self.motions.name(), "the arm").map_err(|why| self.lost(why))?;
        // The controller holds the position at which the arm stopped.
        self.forget_reference();
        Ok(())
    }
}

/// Checks that a motion of an action ended after its cancellation, whether or not the server accepted the cancellation.
fn check_cancelled<E>(
    ended: std::result::Result<Option<E>, RosError>,
    action: &str,
    moved: &str,
) -> std::result::Result<(), String> {
    let why = match ended {
        Ok(Some(_)) => return Ok(()),
        Ok(None) => format!("{action} did not end the motion within {} s after its cancellation", ANSWER.as_secs()),
        Err(error) => format!("the cancellation of the motion was not confirmed: {error}"),
    };
    Err(format!("{why}; {moved} may still move"))
}

/// The error to report for a motion that failed with `error` and was then cancelled. If it could not be cancelled, the
/// error says so, because the robot may still move; a failed stop replaces [`RobotError::Stopped`], which would claim
/// the opposite.
fn with_failed_stop(error: RobotError, cancelled: Result<()>) -> RobotError {
    match (error, cancelled) {
        (error, Ok(())) => error,
        (RobotError::Stopped(_), Err(not_cancelled)) => not_cancelled,
        (RobotError::Lost { peer, why }, Err(RobotError::Lost { why: not_cancelled, .. })) => {
            RobotError::Lost { peer, why: format!("{why}; {not_cancelled}") }
        }
        (error, Err(not_cancelled)) => RobotError::Device(format!("{error}; {not_cancelled}").into()),
    }
}

/// Checks that a motion starts near the arm's measured position.
fn check_start(start: &Joints, measured: &Joints) -> Result<()> {
    Ok(Violation::check_start(start, measured, MAX_START_DISTANCE_RAD)?)
}

/// The motion's positions, velocities and accelerations at regular times, including its end.
fn trajectory(motion: &CheckedMotion, joints: &[String]) -> JointTrajectory {
    let duration_secs = motion.duration_secs();
    let num_points = (duration_secs / POINT_SECS).ceil().max(1.0) as usize;
    let point = |idx: usize| {
        let secs = (idx as f64 * POINT_SECS).min(duration_secs);
        let (q, dq, ddq) = motion.sample(secs);
        JointTrajectoryPoint {
            positions: q.as_slice().to_vec(),
            velocities: dq.as_slice().to_vec(),
            accelerations: ddq.as_slice().to_vec(),
            effort: Vec::new(),
            time_from_start: crate::messages::Duration::from_secs(secs),
        }
    };
    JointTrajectory {
        header: Header::default(),
        joint_names: joints.to_vec(),
        points: (1..=num_points).map(point).collect(),
    }
}

/// The meaning of an error code of FollowJointTrajectory.
fn error_name(code: i32) -> &'static str {
    match code {
        0 => "no error code",
        -1 => "invalid goal",
        -2 => "invalid joints",
        -3 => "old header timestamp",
        -4 => "path tolerance violated",
        -5 => "goal tolerance violated",
        _ => "an unknown error code",
    }
}

impl Arm for TrajectoryArm {
    fn geometry(&self) -> &ArmGeometry {
        &self.config.geometry
    }

    fn state(&mut self) -> Result<ArmState> {
        self.arm_state(ArmMode::Idle)
    }

    fn follow(&mut self, motion: &CheckedMotion, watch: &mut Watch) -> Result<MotionEnd> {
        watch.allow_silence(MAX_SILENCE_SECS);
        let ended = self.follow_to_end(motion, watch);
        self.with_hand_stopped(ended)
    }

    fn wait(&mut self, duration_secs: f64, watch: &mut Watch) -> Result<()> {
        watch.allow_silence(MAX_SILENCE_SECS);
        let ended = self.wait_to_end(duration_secs, watch);
        self.with_hand_stopped(ended)
    }

    fn hand(&mut self) -> Result<HandState> {
        let known = self.known()?;
        let opening_m = known.opening_m.ok_or_else(|| {
            let joints = self.config.finger_joints.join(", ");
            RobotError::Hand(format!("expected the joints {joints} on {}, found none of them", self.states.topic))
        })?;
        Ok(HandState { opening_m, is_grasping: still_holds(self.grasped_m, opening_m), force_n: None })
    }

    fn start_hand(&mut self, command: HandCommand) -> Result<()> {
        let per_m = self.config.gripper_position_per_m;
        let goal = match command {
            HandCommand::Move { opening_m, .. } => GripperCommandGoal { position: opening_m * per_m, max_effort: 0.0 },
            HandCommand::Grasp { force_n, .. } => GripperCommandGoal { position: 0.0, max_effort: force_n },
        };
        let failed = |error: RosError| RobotError::Hand(error.to_string());
        let Some(goal) = self.gripper.send(goal, ANSWER).map_err(failed)? else {
            return Err(RobotError::Hand(format!("{} refused the command", self.gripper.name())));
        };
        self.grasped_m = None;
        self.hand = Some((command, goal));
        Ok(())
    }

    fn finish_hand(&mut self, watch: &mut Watch) -> Result<HandState> {
        let Some((command, goal)) = self.hand.take() else { return self.hand() };
        let (end, result) = match self.hand_end(goal, watch) {
            Ok(ended) => ended,
            Err(error) => {
                // The fingers may still move. If they cannot be stopped now, a later call of `stop` tries again.
                self.hand = Some((command, goal));
                let stopped = self.stop();
                return Err(with_failed_stop(error, stopped));
            }
        };
        let opening_m = result.position / self.config.gripper_position_per_m;
        match (command, end) {
            // Controllers abort if the fingers meet resistance, which is normal for a grasp.
            (HandCommand::Grasp { .. }, GoalEnd::Succeeded | GoalEnd::Aborted) => {
                let is_grasping = result.stalled && opening_m > MIN_HELD_WIDTH_M;
                let opening_m = self.known()?.opening_m.unwrap_or(opening_m);
                self.grasped_m = is_grasping.then_some(opening_m);
                Ok(HandState { opening_m, is_grasping, force_n: None })
            }
            (HandCommand::Move { .. }, GoalEnd::Succeeded) => self.hand(),
            (HandCommand::Move { opening_m: told_m, .. }, GoalEnd::Aborted) => Err(RobotError::Hand(format!(
                "the opening should be {:.0} mm, but is {:.0} mm",
                told_m * 1e3,
                opening_m * 1e3
            ))),
            (_, GoalEnd::Cancelled) => Err(RobotError::Stopped(StopReason::Interrupted)),
            (_, GoalEnd::Unknown) => Err(RobotError::Hand(format!("{} lost the command", self.gripper.name()))),
        }
    }

    /// Does nothing, because the driver has its own thresholds.
    fn set_contact_sensitivity(&mut self, _sensitivity: ContactSensitivity) -> Result<()> {
        Ok(())
    }

    /// Does nothing, because the driver gets the load in other ways.
    fn set_load(&mut self, _load: Load) -> Result<()> {
        Ok(())
    }

    /// Stops the hand; a motion of the arm ends with the call that started it.
    fn stop(&mut self) -> Result<()> {
        let Some((_, goal)) = &mut self.hand else { return Ok(()) };
        let ended = self.gripper.cancel(goal, ANSWER).and_then(|_| self.gripper.result(goal, ANSWER));
        check_cancelled(ended, self.gripper.name(), "the fingers").map_err(RobotError::Hand)?;
        self.hand = None;
        Ok(())
    }

    /// Recovers nothing, because errors are recovered at the arm's driver. Forgets the commanded position, and checks
    /// that joint states arrive.
    fn recover(&mut self) -> Result<()> {
        self.forget_reference();
        self.known().map(drop)
    }
}

/// Whether an object grasped with an opening (m) is still between the fingers at their present opening (m): another
/// client of the gripper may have released it.
fn still_holds(grasped_m: Option<f64>, opening_m: f64) -> bool {
    opening_m > MIN_HELD_WIDTH_M
        && grasped_m.is_some_and(|grasped_m| (opening_m - grasped_m).abs() <= MAX_WIDTH_CHANGE_M)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_object_that_another_client_released_is_not_held() {
        assert!(still_holds(Some(0.030), 0.031));
        assert!(!still_holds(Some(0.030), 0.080) && !still_holds(Some(0.030), 0.0) && !still_holds(None, 0.030));
        // A thin part was taken out, and the fingers have closed.
        assert!(!still_holds(Some(0.003), 0.0));
    }

    #[test]
    fn a_motion_that_goes_on_after_its_cancellation_is_not_reported_as_stopped() {
        assert!(check_cancelled(Ok(Some(GoalEnd::Aborted)), "/follow", "the arm").is_ok());
        let unanswered = RosError::Network { what: "/follow".to_owned(), why: "no answer".to_owned() };
        let lost = |why: &str| RobotError::Lost { peer: "the arm".to_owned(), why: why.to_owned() };
        for (ended, expected) in [
            (Ok(None), "/follow did not end the motion within 5 s after its cancellation; the arm may still move"),
            (
                Err(unanswered),
                "the cancellation of the motion was not confirmed: /follow: no answer; the arm may still move",
            ),
        ] {
            let why = check_cancelled::<GoalEnd>(ended, "/follow", "the arm").unwrap_err();
            assert_eq!(why, expected);
            let stopped = with_failed_stop(RobotError::Stopped(StopReason::Interrupted), Err(lost(&why)));
            assert_eq!(stopped.to_string(), lost(expected).to_string());
            let also_lost = with_failed_stop(lost("no joint states"), Err(lost(&why)));
            assert_eq!(also_lost.to_string(), lost(&format!("no joint states; {expected}")).to_string());
            let reflex = with_failed_stop(RobotError::Reflex("contact".to_owned()), Err(lost(&why)));
            assert!(reflex.latches() && reflex.to_string().contains("contact; "), "{reflex}");
            assert!(reflex.to_string().ends_with(expected), "{reflex}");
        }
        let why = check_cancelled::<GoalEnd>(Ok(None), "/grip", "the fingers").unwrap_err();
        assert!(
            why.starts_with("/grip did not end the motion") && why.ends_with("the fingers may still move"),
            "{why}"
        );
        let stopped = with_failed_stop(lost("no joint states"), Ok(()));
        assert_eq!(stopped.to_string(), lost("no joint states").to_string());
    }

    #[test]
    fn a_motion_from_where_the_arm_is_not_is_refused() {
        let start = Joints::zeros();
        let measured = |joint_rad: f64| Joints::from_fn(|idx, _| if idx == 3 { joint_rad } else { 0.0 });
        assert!(check_start(&start, &measured(0.04)).is_ok() && check_start(&start, &measured(-0.04)).is_ok());
        for joint_rad in [0.06, -0.06, f64::NAN] {
            let error = check_start(&start, &measured(joint_rad)).unwrap_err();
            let is_joint_4 = matches!(&error, RobotError::Unsafe(Violation::StartsElsewhere { joint: 4, .. }));
            assert!(is_joint_4 && !error.latches(), "{error}");
        }
    }
}
