//! Tests the ROS 2 arm against another implementation of the action server, and prints one line for each test.
//!
//! `make test-ros2` runs it with crates/ros2/tests/peers/arm_peer.py, which plays the arm and reacts to each goal in a
//! fixed way.

use std::time::{Duration, Instant};

use sdg_kinematics::{JointLimits, Trajectory, ready_pose};
use sdg_robot::{Arm, GRASP_TOLERANCE_M, HandCommand, Robot, RobotError, SafetyLimits, StopReason, Watch};
use sdg_ros2::Naming;
use sdg_ros2::dds::{ArmConfig, Node, NodeConfig, Rmw, TrajectoryArm};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let domain_id: u16 = arguments.next().ok_or("expected a domain")?.parse()?;
    let rmw: Rmw = arguments.next().unwrap_or("cyclonedds".to_owned()).parse()?;
    let naming = Naming::new("/", "arm_against_peer", &[])?;
    let mut node = Node::join(NodeConfig { domain_id, rmw, is_loopback_only: true, ..NodeConfig::new(naming) })?;
    let mut arm = TrajectoryArm::connect(&mut node, ArmConfig::default(), Duration::from_secs(20))?;
    println!("connected, {}", arm.state()?.mode.name());

    // The peer reaches the first goal, aborts the second, refuses the third, and executes the fourth until it is
    // cancelled.
    println!("first: {}", told(&follow(&mut arm, 0.1, Watch::default())));
    println!("feedback: {}", arm.num_feedback());
    println!("second: {}", told(&follow(&mut arm, 0.2, Watch::default())));
    println!("third: {}", told(&follow(&mut arm, 0.3, Watch::default())));
    println!("fourth: {}", told(&follow(&mut arm, 0.4, soon_stopped())));
    for (name, command) in [
        ("open", HandCommand::Move { opening_m: 0.08, speed_m_s: 0.1 }),
        ("grasp", HandCommand::Grasp { width_m: 0.03, tolerance_m: GRASP_TOLERANCE_M, speed_m_s: 0.1, force_n: 40.0 }),
    ] {
        arm.start_hand(command)?;
        let hand = arm.finish_hand(&mut Watch::default())?;
        println!(
            "{name}: {:.0} mm, {}",
            hand.opening_m * 1e3,
            if hand.is_grasping { "holds" } else { "holds nothing" }
        );
    }
    // The peer executes the fifth goal and moves the hand until both are cancelled.
    arm.start_hand(HandCommand::Move { opening_m: 0.06, speed_m_s: 0.1 })?;
    println!("fifth: {}", told(&follow(&mut arm, -0.4, soon_stopped())));
    // The peer moves the hand until the goal is cancelled.
    arm.start_hand(HandCommand::Move { opening_m: 0.04, speed_m_s: 0.1 })?;
    let endless = arm.finish_hand(&mut Watch::default());
    println!("endless: {}", endless.map_or_else(|error| error.to_string(), |_| "arrived".to_owned()));
    // The peer now stops sending joint states.
    std::thread::sleep(Duration::from_secs(2));
    println!("silent: {}", arm.state().map_or_else(|error| error.to_string(), |state| state.mode.name().to_owned()));
    Ok(())
}

/// Moves the arm to the ready pose with the last joint rotated by `by_rad`, with the usual checks of every motion.
fn follow(arm: &mut TrajectoryArm, by_rad: f64, watch: Watch) -> Result<(), RobotError> {
    let mut robot = Robot::new(arm, SafetyLimits::default(), watch);
    let start = robot.commanded()?;
    let mut end = ready_pose();
    end[6] += by_rad;
    let limits = JointLimits::panda().scaled(0.1, 0.1, 0.1)?;
    robot.follow(Trajectory::point_to_point(&start, &end, &limits)?)
}

/// A watch that stops the arm after 0.7 s, as a person does.
fn soon_stopped() -> Watch {
    let begun = Instant::now();
    let stop = move || (begun.elapsed() > Duration::from_millis(700)).then_some(StopReason::Interrupted);
    Watch::new(Box::new(stop))
}

fn told(result: &Result<(), RobotError>) -> String {
    result.as_ref().map_or_else(ToString::to_string, |()| "arrived".to_owned())
}
