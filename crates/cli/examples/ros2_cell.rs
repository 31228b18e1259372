//! A cell in MuJoCo with the interface of a real ROS cell: the wrist camera is published, and arm and hand are action
//! servers.
//!
//! ```text
//! ros2_cell PART [SEED [DOMAIN [RMW]]]
//! image, camera_info, /tf: 5 a second │ /joint_states: 50 │ FollowJointTrajectory, GripperCommand
//! ```
//! examples/ros2/README.md uses it with `sdg ros2`. Simulated time follows the clock.

use std::time::{Duration, Instant, SystemTime};

use anyhow::{Context, Result};
use sdg_geometry::PinholeCamera;
use sdg_kinematics::{JointVector, NUM_JOINTS, ready_pose};
use sdg_robot::{Arm, HandCommand, PERIOD_SECS};
use sdg_ros2::dds::{ActionServer, ActionType, Asked, GoalEnd, Node, NodeConfig, Publisher, Qos, Rmw};
use sdg_ros2::messages::{
    CameraInfo, FollowJointTrajectoryFeedback, FollowJointTrajectoryGoal, FollowJointTrajectoryResult,
    GripperCommandFeedback, GripperCommandGoal, GripperCommandResult, Header, Image, JointState, JointTrajectory,
    JointTrajectoryPoint, TfMessage, Time,
};
use sdg_ros2::{Naming, camera_info, encoding, found};
use sdg_simulation::objects::ObjectSpec;
use sdg_simulation::scene::{SceneVariation, VariationConfig};
use sdg_simulation::{Workcell, WorkcellConfig};

const CAMERA_FRAME: &str = "camera_optical_frame";
const BASE_FRAME: &str = "panda_link0";
const PICTURE_EVERY: Duration = Duration::from_millis(200);
const STATES_EVERY: Duration = Duration::from_millis(20);
/// Maximum lag of the simulation behind the clock, s. It is longer than the rendering of a picture; otherwise every
/// picture would delay the arm.
const MAX_BEHIND_SECS: f64 = 0.5;
/// Fingers that move by less than this within a tenth of a second are at rest, m.
const STILL_M: f64 = 2e-4;
/// A hand whose opening is within this distance of its target has reached it, m.
const THERE_M: f64 = 1e-3;
/// Minimum duration of a hand command, so that the force can build up.
const MIN_HAND: Duration = Duration::from_millis(400);
const MAX_HAND: Duration = Duration::from_secs(3);
/// A part is lifted if it has risen by at least this, m.
const LIFTED_M: f64 = 0.05;

type Trajectories = ActionServer<FollowJointTrajectoryGoal, FollowJointTrajectoryResult, FollowJointTrajectoryFeedback>;
type Grippers = ActionServer<GripperCommandGoal, GripperCommandResult, GripperCommandFeedback>;

struct Cell {
    workcell: Workcell,
    trajectories: Trajectories,
    grippers: Grippers,
    images: Publisher<Image>,
    infos: Publisher<CameraInfo>,
    transforms: Publisher<TfMessage>,
    states: Publisher<JointState>,
    /// The current motion, its start time, and its start position.
    motion: Option<(JointTrajectory, f64, JointVector)>,
    /// Joint positions that the arm holds.
    held: JointVector,
    hand: Option<(HandCommand, Instant, f64)>,
    secs: f64,
}

fn main() -> Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let argument = |idx: usize, default: &str| arguments.get(idx).cloned().unwrap_or_else(|| default.to_owned());
    let part = ObjectSpec::by_name(&argument(0, "pendulum"))?;
    let scene = SceneVariation::sample(Some(&part), &VariationConfig::default(), argument(1, "1").parse()?);
    let config = WorkcellConfig { wrist_camera: Some(PinholeCamera::WRIST), ..WorkcellConfig::new(scene) };
    let naming = Naming::new("/", "mujoco_cell", &[])?;
    let mut node = Node::join(NodeConfig {
        domain_id: argument(2, "0").parse()?,
        rmw: argument(3, "fastrtps").parse::<Rmw>().map_err(anyhow::Error::msg)?,
        is_loopback_only: true,
        ..NodeConfig::new(naming)
    })?;
    let follow = ActionType { package: "control_msgs", name: "FollowJointTrajectory" };
    let grip = ActionType { package: "control_msgs", name: "GripperCommand" };
    let mut cell = Cell {
        workcell: Workcell::new(&config)?,
        trajectories: node.action_server("/panda_arm_controller/follow_joint_trajectory", follow)?,
        grippers: node.action_server("/panda_hand_controller/gripper_cmd", grip)?,
        images: node.publish("image", Qos::RESULTS)?,
        infos: node.publish("camera_info", Qos::RESULTS)?,
        transforms: node.publish("/tf", Qos::TRANSFORMS)?,
        states: node.publish("/joint_states", Qos::RESULTS)?,
        motion: None,
        held: ready_pose(),
        hand: None,
        secs: 0.0,
    };
    println!("a cell with {} in MuJoCo; Ctrl-C ends it", argument(0, "pendulum"));
    cell.run()
}

impl Cell {
    fn run(&mut self) -> Result<()> {
        let mut begun = Instant::now();
        let (mut last_picture, mut last_states) = (begun, begun);
        let lay_m = self.workcell.base_from_object().context("a part")?.translation.z;
        let mut is_lifted = false;
        loop {
            // On a slow computer, the simulation does not catch up with the clock. Otherwise the loop below might never
            // end, so that requests would wait forever, and the arm would move too fast.
            let behind_secs = begun.elapsed().as_secs_f64() - self.secs - MAX_BEHIND_SECS;
            begun += Duration::from_secs_f64(behind_secs.max(0.0));
            let until_secs = begun.elapsed().as_secs_f64();
            while self.secs < until_secs {
                self.advance()?;
            }
            self.serve()?;
            if last_states.elapsed() >= STATES_EVERY {
                last_states = Instant::now();
                self.tell_states()?;
            }
            if last_picture.elapsed() >= PICTURE_EVERY {
                last_picture = Instant::now();
                self.tell_picture()?;
            }
            let height_m = self.workcell.base_from_object().context("a part")?.translation.z - lay_m;
            if (height_m > LIFTED_M) != is_lifted {
                is_lifted = !is_lifted;
                println!("{}", if is_lifted { "the part is lifted" } else { "the part is down" });
            }
            std::thread::sleep(Duration::from_millis(1));
        }
    }

    /// Advances the simulation by a millisecond.
    fn advance(&mut self) -> Result<()> {
        let zero = JointVector::zeros();
        let (q, dq, ddq) = match &self.motion {
            None => (self.held, zero, zero),
            Some((trajectory, since, from)) => match at(trajectory, from, self.secs - since) {
                Some(reference) => reference,
                None => (joints(&trajectory.points[trajectory.points.len() - 1].positions), zero, zero),
            },
        };
        self.workcell.advance(&q, &dq, &ddq)?;
        self.held = q;
        self.secs += PERIOD_SECS;
        Ok(())
    }

    fn serve(&mut self) -> Result<()> {
        let is_whole = |goal: &FollowJointTrajectoryGoal| {
            let points = &goal.trajectory.points;
            goal.trajectory.joint_names.len() == NUM_JOINTS
                && !points.is_empty()
                && points.iter().all(|point| {
                    [&point.positions, &point.velocities, &point.accelerations]
                        .iter()
                        .all(|values| values.len() == NUM_JOINTS && values.iter().all(|value| value.is_finite()))
                })
        };
        match self.trajectories.asked(is_whole)? {
            Some(Asked::Goal(goal)) => self.motion = Some((goal.trajectory, self.secs, self.held)),
            Some(Asked::Cancel) => {
                self.motion = None;
                self.trajectories.end(GoalEnd::Cancelled, FollowJointTrajectoryResult::default())?;
            }
            None => {}
        }
        if let Some((trajectory, since, _)) = &self.motion
            && self.secs - since > trajectory.points[trajectory.points.len() - 1].time_from_start.secs()
        {
            self.motion = None;
            self.trajectories.end(GoalEnd::Succeeded, FollowJointTrajectoryResult::default())?;
        }
        if let Some(Asked::Goal(goal)) = self.grippers.asked(|goal| goal.position.is_finite())? {
            let command = match goal.max_effort > 0.0 {
                true => HandCommand::Grasp {
                    width_m: 0.04,
                    tolerance_m: [0.04; 2],
                    speed_m_s: 0.05,
                    force_n: goal.max_effort,
                },
                false => HandCommand::Move { opening_m: 2.0 * goal.position, speed_m_s: 0.1 },
            };
            self.workcell.start_hand(command)?;
            self.hand = Some((command, Instant::now(), self.workcell.opening_m()));
        }
        self.serve_hand()
    }

    fn serve_hand(&mut self) -> Result<()> {
        let Some((command, since, before_m)) = self.hand else { return Ok(()) };
        if since.elapsed() < MIN_HAND {
            return Ok(());
        }
        let opening_m = self.workcell.opening_m();
        let is_there =
            matches!(command, HandCommand::Move { opening_m: told_m, .. } if (told_m - opening_m).abs() < THERE_M);
        let is_still = (opening_m - before_m).abs() < STILL_M;
        let is_over = is_there || is_still || since.elapsed() > MAX_HAND;
        if !is_over {
            // The hand is checked again after a time in which moving fingers exceed `STILL_M`.
            self.hand = Some((command, Instant::now() - MIN_HAND + Duration::from_millis(100), opening_m));
            return Ok(());
        }
        self.hand = None;
        let stalled = matches!(command, HandCommand::Grasp { .. });
        let end = if is_there || stalled { GoalEnd::Succeeded } else { GoalEnd::Aborted };
        let result = GripperCommandResult { position: 0.5 * opening_m, effort: 0.0, stalled, reached_goal: is_there };
        Ok(self.grippers.end(end, result)?)
    }

    fn tell_states(&mut self) -> Result<()> {
        let state = self.workcell.state()?;
        let finger_m = 0.5 * self.workcell.opening_m();
        let mut name: Vec<String> = (1..=NUM_JOINTS).map(|joint| format!("panda_joint{joint}")).collect();
        name.extend((1..=2).map(|finger| format!("panda_finger_joint{finger}")));
        let with_fingers = |values: &JointVector, finger: f64| {
            let fingers = [finger, finger];
            values.iter().chain(&fingers).copied().collect::<Vec<f64>>()
        };
        let header = Header { stamp: Time::from_system(SystemTime::now()), frame_id: String::new() };
        let (position, velocity) = (with_fingers(&state.q, finger_m), with_fingers(&state.dq, 0.0));
        let message = JointState { header: header.clone(), name, position, velocity, effort: Vec::new() };
        self.states.send(message)?;
        if self.motion.is_some() {
            let actual = JointTrajectoryPoint { positions: state.q.as_slice().to_vec(), ..Default::default() };
            self.trajectories.feedback(FollowJointTrajectoryFeedback { header, actual, ..Default::default() })?;
        }
        Ok(())
    }

    fn tell_picture(&mut self) -> Result<()> {
        let stamp = Time::from_system(SystemTime::now());
        let view = self.workcell.wrist_view()?;
        let header = Header { stamp, frame_id: CAMERA_FRAME.to_owned() };
        let of_base = Header { stamp, frame_id: BASE_FRAME.to_owned() };
        let transform = found::to_transform(&of_base, CAMERA_FRAME, &view.camera.world_from_camera);
        self.transforms.send(TfMessage { transforms: vec![transform] })?;
        self.infos.send(camera_info::to_camera_info(&view.camera.intrinsics, header.clone()))?;
        Ok(self.images.send(encoding::to_image(&view.image, header))?)
    }
}

fn joints(values: &[f64]) -> JointVector {
    JointVector::from_iterator(values.iter().copied())
}

/// Positions, velocities and accelerations at a time; `None` after the end. Cubic interpolation, as ros2_control does
/// for points with positions and velocities.
fn at(trajectory: &JointTrajectory, from: &JointVector, secs: f64) -> Option<(JointVector, JointVector, JointVector)> {
    let next = trajectory.points.iter().position(|point| point.time_from_start.secs() >= secs)?;
    let to = &trajectory.points[next];
    let (to_secs, q1, dq1) = (to.time_from_start.secs(), joints(&to.positions), joints(&to.velocities));
    let (from_secs, q0, dq0) = match next.checked_sub(1).map(|before| &trajectory.points[before]) {
        Some(before) => (before.time_from_start.secs(), joints(&before.positions), joints(&before.velocities)),
        None => (0.0, *from, JointVector::zeros()),
    };
    let span = (to_secs - from_secs).max(PERIOD_SECS);
    let u = ((secs - from_secs) / span).clamp(0.0, 1.0);
    let (a, b) = (q1 - q0 - dq0 * span, dq1 * span - dq0 * span);
    // q0 + dq0 s u + (3a - b) u² + (b - 2a) u³
    let (c2, c3) = (a * 3.0 - b, b - a * 2.0);
    let q = q0 + dq0 * (span * u) + c2 * (u * u) + c3 * (u * u * u);
    let dq = dq0 + (c2 * (2.0 * u) + c3 * (3.0 * u * u)) / span;
    let ddq = (c2 * 2.0 + c3 * (6.0 * u)) / (span * span);
    Some((q, dq, ddq))
}
