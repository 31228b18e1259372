//! Faults of a grasp over the network. Unless the sequence can continue, the arm stops, one line states the reason, and
//! nothing moves by itself afterwards.
//!
//! Faults without the grasp sequence are in fci_faults.rs, faults of an arm in this process in robot_faults.rs.

use std::thread;
use std::time::{Duration, Instant};

use crate::network::{Twin, cell, connect, serve, some_motion};
use crate::old_robot;
use sdg_fci::server::Pace;
use sdg_kinematics::{ArmGeometry, CartesianLimits, JointLimits, LineOptions, Trajectory};
use sdg_robot::{
    Arm, ArmMode, FrankaArm, GraspConfig, GraspOutcome, GraspStep, GraspTarget, PartFinder, Robot, RobotError,
    SafetyLimits, Scheduling, StopReason, Watch, grasp,
};
use sdg_simulation::{SharedPositions, Workcell};

/// Checks that neither the arm nor the held part moves while time passes.
fn assert_stands_still(arm: &mut FrankaArm, positions: &SharedPositions) {
    // First, the remaining motion of the stop decays.
    arm.wait(0.2, &mut Watch::default()).ok();
    let before = positions.get();
    arm.wait(0.3, &mut Watch::default()).ok();
    let moved = before.iter().zip(positions.get()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(moved < 2e-3, "{moved}");
}

/// Checks that a motion is refused, and nothing moves.
fn assert_latched(robot: &mut Robot<FrankaArm>, motion: Trajectory, positions: &SharedPositions) {
    assert!(matches!(robot.follow(motion), Err(RobotError::Latched(_))));
    assert_stands_still(robot.arm(), positions);
}

/// Checks that the arm moves again after a requested recovery.
fn assert_recovers(robot: &mut Robot<FrankaArm>) {
    robot.recover().unwrap();
    let motion = some_motion(robot.arm());
    robot.follow(motion).unwrap();
}

/// Waits in the watch of a moving arm, so that the robot misses commands.
fn stalling(stalls: Vec<(u32, Duration)>) -> Watch {
    let mut cycles = 0;
    Watch::new(Box::new(move || {
        cycles += 1;
        if let Some((_, stall)) = stalls.iter().find(|(at, _)| *at == cycles) {
            thread::sleep(*stall);
        }
        None
    }))
}

/// Time after which a command that has not arrived counts as lost.
const MAX_WAIT: Duration = Duration::from_millis(20);

#[test]
fn late_commands_are_made_up_for_on_the_way() {
    let cell = cell("pendulum", 101);
    let (server, _) = serve(&cell, Pace::Lockstep { max_wait: MAX_WAIT });
    let mut arm = connect(&server).unwrap();
    let start = arm.state().unwrap().q_commanded;
    let motion = |from, to| {
        let limits = JointLimits::panda().scaled(0.6, 0.4, 0.2).unwrap();
        Trajectory::point_to_point(from, to, &limits).unwrap()
    };
    let mut end = start;
    end[0] += 0.6;
    end[4] += 0.4;
    let duration_ms = (motion(&start, &end).duration_secs() * 1e3) as u32;
    // A robot that continues at a constant acceleration soon deviates where the commanded acceleration changes: at the
    // start, at the end and between. About five commands are lost each time.
    let stalls = [3, 50, 150, duration_ms / 2, duration_ms - 60, duration_ms - 8].map(|at| (at, 5 * MAX_WAIT));
    let mut robot = Robot::new(&mut arm, Workcell::safety_limits(), stalling(stalls.to_vec()));
    robot.follow(motion(&start, &end)).unwrap();
    let lost = server.statistics().num_motion_cycles - server.statistics().num_commands;
    assert!(lost >= 12, "{lost}");
    let apart = (robot.arm().state().unwrap().q_commanded - end).amax();
    assert!(apart < 1e-4, "{apart}");
}

#[test]
fn a_program_that_stalls_for_longer_is_stopped_by_the_robot() {
    let cell = cell("pendulum", 101);
    let (server, positions) = serve(&cell, Pace::Lockstep { max_wait: MAX_WAIT });
    let mut arm = connect(&server).unwrap();
    let mut robot = Robot::new(&mut arm, Workcell::safety_limits(), stalling(vec![(400, 40 * MAX_WAIT)]));
    let motion = some_motion(robot.arm());
    let error = robot.follow(motion.clone()).unwrap_err();
    assert!(matches!(error, RobotError::Reflex(_)), "{error}");
    let line = error.to_string();
    assert!(line.contains("communication_constraints_violation") && !line.contains('\n'), "{line}");
    assert_latched(&mut robot, motion, &positions);
    assert_recovers(&mut robot);
}

#[test]
fn a_table_that_is_higher_than_its_file_says_stops_the_arm() {
    let cell = cell("pendulum", 101);
    let (server, positions) = serve(&cell, Pace::LOCKSTEP);
    let mut arm = connect(&server).unwrap();
    let start = arm.state().unwrap().q_commanded;
    arm.set_contact_sensitivity(sdg_robot::ContactSensitivity::Free).unwrap();
    let wrong = SafetyLimits { table_height_m: -0.6, ..Workcell::safety_limits() };
    let mut robot = Robot::new(&mut arm, SafetyLimits { workspace: None, ..wrong }, Watch::default());
    // The motion goes straight down, 5 cm into the table.
    let panda = ArmGeometry::panda();
    let mut base_from_tcp = panda.forward(&start);
    base_from_tcp.translation.z = -0.05;
    let path = panda.straight_path(&start, &base_from_tcp, &LineOptions::default()).unwrap();
    let slow = CartesianLimits::panda().scaled(0.1, 0.1, 0.05).unwrap();
    let error = robot.follow(Trajectory::along_path(path, &JointLimits::panda(), &slow).unwrap()).unwrap_err();
    assert!(matches!(error, RobotError::Reflex(_)), "{error}");
    let line = error.to_string();
    assert!(line.contains("_reflex") && !line.contains('\n'), "{line}");
    assert_eq!(robot.arm().state().unwrap().mode, ArmMode::Reflex);
    let motion = some_motion(robot.arm());
    assert_latched(&mut robot, motion, &positions);
}

/// Perception with a picture of a given age.
struct OldPicture(Twin, Duration);

impl PartFinder<FrankaArm> for OldPicture {
    fn find(&mut self, arm: &mut FrankaArm) -> sdg_robot::Result<Option<GraspTarget>> {
        self.0.find(arm)
    }

    fn picture_time(&self) -> Option<Instant> {
        Instant::now().checked_sub(self.1)
    }
}

#[test]
fn no_motion_begins_on_a_detection_that_is_older_than_a_second() {
    let cell = cell("pendulum", 101);
    let (server, positions) = serve(&cell, Pace::LOCKSTEP);
    let mut arm = connect(&server).unwrap();
    let mount = cell.wrist_camera();
    let mut finder = OldPicture(Twin { cell, positions: positions.clone() }, Duration::from_millis(1200));
    let mut robot = Robot::new(&mut arm, Workcell::safety_limits(), Watch::default());
    let report = grasp(&mut robot, &mut finder, &mut (), mount, &GraspConfig::default()).unwrap();
    let GraspOutcome::Failed { step: GraspStep::Detect, why } = &report.outcome else { panic!("{report:?}") };
    assert_eq!(why, "the detection is 1.2 s old when the arm should move, at most 1.0 s are allowed");
    assert_eq!(report.looks, [1, 0], "the way to the part was not begun");
    assert_stands_still(robot.arm(), &positions);
}

#[test]
fn a_part_that_slips_is_told_by_the_hand() {
    let cell = cell("pendulum", 101);
    let (server, positions) = serve(&cell, Pace::LOCKSTEP);
    let mut arm = connect(&server).unwrap();
    let mount = cell.wrist_camera();
    let mut twin = Twin { cell, positions: positions.clone() };
    let mut robot = Robot::new(&mut arm, Workcell::safety_limits(), Watch::default());
    // The force is too small for the part's weight.
    let config = GraspConfig { grasp_force_n: 0.3, ..GraspConfig::default() };
    let report = grasp(&mut robot, &mut twin, &mut (), mount, &config).unwrap();
    let GraspOutcome::Failed { step, why } = report.outcome else { panic!("0.3 N hold nothing") };
    assert!(matches!(step, GraspStep::Lift | GraspStep::Hold), "{step}: {why}");
    assert!(why.contains("slipped") && !why.contains('\n'), "{why}");
    assert!(!twin.is_lifted());
    assert_stands_still(robot.arm(), &positions);
}

#[test]
fn a_robot_of_another_version_is_reached_and_not_driven() {
    let (address, old_robot) = old_robot::serve();
    let address = format!("127.0.0.1:{}", address.port()).parse().unwrap();
    let error = FrankaArm::connect(&address, Scheduling::Ordinary).unwrap_err().to_string();
    assert_eq!(error, "the robot speaks version 4 of the protocol, expected 5 (Panda) or 10 (FR3)");
    old_robot.join().unwrap();
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
    assert_eq!(error.to_string(), "the arm was stopped: a person requested it");
    // The motion ended at rest and without an error of the robot.
    let state = robot.arm().state().unwrap();
    assert_eq!(state.mode, ArmMode::Idle);
    assert_latched(&mut robot, motion, &positions);
    assert_recovers(&mut robot);
}

#[test]
fn a_hand_that_fails_ends_the_grasp() {
    let cell = cell("pendulum", 101);
    let (server, positions) = serve(&cell, Pace::LOCKSTEP);
    let mut arm = connect(&server).unwrap();
    let mount = cell.wrist_camera();
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
    let error = FrankaArm::connect(&"127.0.0.1:9".parse().unwrap(), Scheduling::Ordinary).unwrap_err().to_string();
    assert!(error.starts_with("the robot at 127.0.0.1:9 could not be reached: ") && !error.contains('\n'), "{error}");
}
