//! Whole grasps over TCP and UDP: the sequence, our client, the server, MuJoCo; and what goes wrong on the network.
//!
//! The table of all parts is made by `examples/network_grasps.rs`.

#![allow(clippy::unwrap_used)]

mod network;

use network::{Twin, connect, serve};
use sdg_fci::server::Pace;
use sdg_kinematics::{JointLimits, JointVector, Trajectory};
use sdg_robot::{Arm, GraspConfig, GraspOutcome, GraspReport, Robot, RobotError, StopReason, Watch, grasp};
use sdg_simulation::objects::ObjectSpec;
use sdg_simulation::scene::{SceneVariation, VariationConfig};
use sdg_simulation::{RenderConfig, Workcell, WorkcellConfig};

fn cell(part: &str, seed: u64) -> Workcell {
    let spec = ObjectSpec::by_name(part).unwrap();
    let config = VariationConfig { appearance: false, distractors: 0..=2, ..VariationConfig::default() };
    let scene = SceneVariation::sample(Some(&spec), &config, seed);
    let wrist_render = RenderConfig { shadow_size: 0, samples: 0, ..RenderConfig::default() };
    let mut cell = Workcell::new(&WorkcellConfig { wrist_render, ..WorkcellConfig::new(scene) }).unwrap();
    cell.reset_for_attempt(&GraspConfig::default(), seed).unwrap();
    cell
}

fn run(cell: Workcell, watch: Watch) -> (sdg_robot::Result<GraspReport>, Twin) {
    let (server, positions) = serve(&cell, Pace::LOCKSTEP);
    let mount = cell.wrist_mount();
    let mut twin = Twin { cell, positions };
    let mut arm = connect(&server).unwrap();
    let mut robot = Robot::new(&mut arm, Workcell::safety_limits(), watch);
    let report = grasp(&mut robot, &mut twin, &mut (), mount, &GraspConfig::default());
    drop(arm);
    server.stop().unwrap();
    (report, twin)
}

#[test]
fn a_part_is_grasped_over_the_network_in_lockstep() {
    let (report, mut twin) = run(cell("pendulum", 101), Watch::default());
    let report = report.unwrap();
    // The hand's word and the truth agree.
    assert_eq!(report.outcome, GraspOutcome::Held, "{report:?}");
    assert!(twin.is_lifted());
    assert_eq!(report.looks, [1, 1]);
}

/// A motion of two seconds from where the arm is.
fn some_motion(arm: &mut impl Arm) -> Trajectory {
    let start = arm.state().unwrap().q_commanded;
    let end = start + JointVector::from([0.4, 0.0, 0.0, 0.0, 0.0, 0.0, 0.3]);
    Trajectory::point_to_point(&start, &end, &JointLimits::franka().scaled(0.1, 0.1, 0.1).unwrap()).unwrap()
}

#[test]
fn a_server_that_goes_in_motion_is_a_lost_connection() {
    let cell = cell("pendulum", 101);
    let (server, _) = serve(&cell, Pace::LOCKSTEP);
    let mut arm = connect(&server).unwrap();
    let mut server = Some(server);
    let mut cycles = 0;
    let watch = Watch::new(Box::new(move || {
        cycles += 1;
        if cycles == 500 {
            drop(server.take());
        }
        None
    }));
    let mut robot = Robot::new(&mut arm, Workcell::safety_limits(), watch);
    let motion = some_motion(robot.arm());
    let error = robot.follow(motion.clone()).unwrap_err();
    assert!(matches!(error, RobotError::Lost { .. }), "{error}");
    let line = error.to_string();
    assert!(line.starts_with("the connection to the robot at 127.0.0.1") && !line.contains('\n'), "{line}");
    assert!(matches!(robot.follow(motion), Err(RobotError::Latched(_))));
    assert!(robot.watch().states().len() >= 490);
}

#[test]
fn a_person_stops_the_arm_on_the_network() {
    let cell = cell("pendulum", 101);
    let (server, positions) = serve(&cell, Pace::LOCKSTEP);
    let mut arm = connect(&server).unwrap();
    let mut cycles = 0;
    let watch = Watch::new(Box::new(move || {
        cycles += 1;
        (cycles == 500).then_some(StopReason::Interrupted)
    }));
    let mut robot = Robot::new(&mut arm, Workcell::safety_limits(), watch);
    let motion = some_motion(robot.arm());
    let error = robot.follow(motion.clone()).unwrap_err();
    assert_eq!(error.to_string(), "the arm was stopped: a person asked for it");
    // It ended by itself, at rest and without an error of the robot.
    let state = robot.arm().state().unwrap();
    assert_eq!(state.mode, sdg_robot::ArmMode::Idle);
    let before = positions.get();
    assert!(matches!(robot.follow(motion), Err(RobotError::Latched(_))));
    robot.arm().wait(0.2, &mut Watch::default()).unwrap();
    let moved = before.iter().zip(positions.get()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(moved < 2e-3, "{moved}");
    robot.recover().unwrap();
    let motion = some_motion(robot.arm());
    robot.follow(motion).unwrap();
}

#[test]
fn a_hand_that_fails_ends_the_grasp() {
    let cell = cell("pendulum", 101);
    let (server, positions) = serve(&cell, Pace::LOCKSTEP);
    let mut arm = connect(&server).unwrap();
    let mount = cell.wrist_mount();
    let mut twin = Twin { cell, positions };
    server.set_hand_failing(true);
    let mut robot = Robot::new(&mut arm, Workcell::safety_limits(), Watch::default());
    let error = grasp(&mut robot, &mut twin, &mut (), mount, &GraspConfig::default()).unwrap_err();
    assert!(matches!(error, RobotError::Hand(_)), "{error}");
    assert!(robot.latched().is_some());
    let motion = some_motion(robot.arm());
    assert!(matches!(robot.follow(motion), Err(RobotError::Latched(_))));
}

#[test]
fn nobody_at_the_address_is_one_line() {
    let error = sdg_robot::FrankaArm::connect(&"127.0.0.1:9".parse().unwrap(), sdg_robot::Scheduling::Ordinary)
        .unwrap_err()
        .to_string();
    assert!(
        error.starts_with("the connection to the robot at 127.0.0.1:9 is lost") && !error.contains('\n'),
        "{error}"
    );
}
