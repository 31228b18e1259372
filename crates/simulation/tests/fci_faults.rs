//! Injected faults: the arm stops, the error is one clear line, and nothing moves until the recovery.

use std::io::Write;
use std::net::TcpStream;
use std::ops::ControlFlow;
use std::thread;
use std::time::{Duration, Instant};

use crate::bare_client::{BareClient, SPEED, velocity_after};
use crate::fci_support::{connect, connect_hand, serve, serve_panda};
use crate::old_robot;
use sdg_fci::client::{InternalController, Robot, RobotConfig};
use sdg_fci::server::Pace;
use sdg_fci::wire::{
    CollisionBehavior, ControllerMode, Header, HeaderKind, MotionCommand, MotionGeneratorMode, Request, RobotCommand,
    RobotMode, RobotState, Status, Version,
};
use sdg_fci::{FciError, Limits, RobotError, read_message};

/// Largest time until joint 1 is at rest: it brakes from the test's speed in 0.03 s; the rest allows for the controller
/// to settle.
const STOPPING_TIME: Duration = Duration::from_millis(200);

/// Waits until joint 1 is at rest, at most [`STOPPING_TIME`] of the robot's clock, and checks that it stays at rest.
fn assert_stands(robot: &mut Robot) {
    let stopped = robot.read_state().unwrap().clone();
    let begin = stopped.message_id;
    let mut state = stopped;
    while state.dq[0].abs() > 0.01 {
        state = robot.read_state().unwrap().clone();
        assert!(state.message_id - begin < STOPPING_TIME.as_millis() as u64, "it still moves: {:?}", state.dq);
    }
    let q = state.q;
    for _ in 0..50 {
        let later = robot.read_state().unwrap();
        assert!((later.q[0] - q[0]).abs() < 2e-3, "it moves by itself");
    }
}

/// Checks that a motion is refused until the recovery, and possible after it.
fn assert_waits_for_recovery(robot: &mut Robot) {
    let hold = |state: &RobotState, _| ControlFlow::Break(state.q_desired);
    assert_eq!(robot.read_state().unwrap().robot_mode, RobotMode::Reflex);
    let refused = robot.control_joint_positions(InternalController::JointImpedance, hold).unwrap_err();
    assert_eq!(refused.to_string(), "move: not possible in the robot's present mode");
    robot.automatic_error_recovery().unwrap();
    assert_eq!(robot.read_state().unwrap().robot_mode, RobotMode::Idle);
    robot.control_joint_positions(InternalController::JointImpedance, hold).unwrap();
}

fn errors_of(error: &FciError) -> Vec<RobotError> {
    match error {
        FciError::Motion { status: Status::ReflexAborted, errors, .. } => errors.iter().collect(),
        other => panic!("{other}"),
    }
}

#[test]
fn a_client_that_is_cut_off_in_a_motion_stops_the_arm() {
    let server = serve(Pace::LOCKSTEP, Limits::PANDA);
    let (mut client, _) = BareClient::connect(&server, 5);
    client.turn(400);
    drop(client);
    let mut robot = connect(&server);
    assert!(robot.read_state().unwrap().errors.contains(RobotError::CommunicationConstraintsViolation));
    assert_stands(&mut robot);
    assert_waits_for_recovery(&mut robot);
}

#[test]
fn twenty_lost_commands_stop_the_arm_and_nineteen_are_made_up_for() {
    let server = serve(Pace::Lockstep { max_wait: Duration::from_millis(100) }, Limits::PANDA);
    let mut robot = connect(&server);
    for (num_lost, is_stopped) in [(19, false), (20, true)] {
        let mut ms = 0;
        let result = robot.control_unchecked(
            ControllerMode::JointImpedance,
            MotionGeneratorMode::JointVelocity,
            |state, step| {
                ms += step.as_millis() as u64;
                if (400..400 + num_lost).contains(&ms) {
                    return Ok(None);
                }
                // The lost commands were replaced at constant velocity.
                if ms == 400 + num_lost {
                    assert!((state.dq_desired[0] - SPEED).abs() < 1e-9, "{:?}", state.dq_desired);
                }
                let dq = velocity_after(ms.min(900 - ms.min(900)));
                let motion = MotionCommand { dq, ..MotionCommand::default() };
                let command = RobotCommand { motion, ..RobotCommand::default() };
                Ok(Some(if ms < 900 { ControlFlow::Continue(command) } else { ControlFlow::Break(command) }))
            },
        );
        match result {
            Ok(_) => assert!(!is_stopped),
            Err(error) => {
                assert!(is_stopped, "{error}");
                assert_eq!(errors_of(&error), [RobotError::CommunicationConstraintsViolation]);
            }
        }
    }
    assert_stands(&mut robot);
    assert_waits_for_recovery(&mut robot);
}

#[test]
fn lost_commands_in_the_middle_of_a_motion_are_made_up_for_in_every_generator() {
    let server = serve(Pace::Lockstep { max_wait: Duration::from_millis(50) }, Limits::PANDA);
    let mut robot = connect(&server);
    for generator in [
        MotionGeneratorMode::JointPosition,
        MotionGeneratorMode::JointVelocity,
        MotionGeneratorMode::CartesianPosition,
        MotionGeneratorMode::CartesianVelocity,
    ] {
        for has_elbow in [false, true] {
            let start = robot.read_state().unwrap().clone();
            let mut ms = 0;
            robot
                .control_unchecked(ControllerMode::JointImpedance, generator, |_, step| {
                    ms += step.as_millis() as u64;
                    // Three lost commands during the acceleration, and three at the highest speed.
                    if [250, 251, 252, 500, 501, 502].contains(&ms) {
                        return Ok(None);
                    }
                    // The motion goes forward and back in two seconds.
                    let phase = std::f64::consts::PI * (ms as f64 / 1000.0).min(2.0);
                    let (shape, rate) = (0.5 * (1.0 - phase.cos()), 0.5 * std::f64::consts::PI * phase.sin());
                    let mut motion = MotionCommand {
                        q: start.q_desired,
                        base_from_ee: start.base_from_ee_commanded,
                        elbow: start.elbow_commanded,
                        valid_elbow: has_elbow,
                        ..MotionCommand::default()
                    };
                    motion.q[0] += 0.2 * shape;
                    motion.dq[0] = 0.2 * rate;
                    motion.base_from_ee[13] += 0.05 * shape;
                    motion.twist[1] = 0.05 * rate;
                    motion.elbow[0] += 0.05 * shape;
                    let command = RobotCommand { motion, ..RobotCommand::default() };
                    Ok(Some(if ms < 2000 { ControlFlow::Continue(command) } else { ControlFlow::Break(command) }))
                })
                .unwrap_or_else(|error| panic!("{generator:?}, elbow: {has_elbow}: {error}"));
        }
    }
}

#[test]
fn the_table_is_felt_and_stops_the_arm() {
    let (_server, mut robot) = serve_panda();
    robot.set_collision_behavior(&CollisionBehavior::new([5.0; 7], [10.0; 7], [5.0; 6], [10.0; 6])).unwrap();
    let mut ms = 0;
    let error = robot
        .control_twists(InternalController::JointImpedance, |_, step| {
            ms += step.as_millis() as u64;
            ControlFlow::Continue([0.0, 0.0, -0.1 * (ms as f64 / 300.0).min(1.0), 0.0, 0.0, 0.0])
        })
        .unwrap_err();
    assert!(errors_of(&error).contains(&RobotError::CartesianReflex), "{error}");
    assert!(robot.recent_states().any(|state| state.cartesian_contact[2] > 0.0));
    let state = robot.read_state().unwrap();
    assert!(state.cartesian_collision[2] > 0.0);
    // The fingers touch the table.
    assert!(state.base_from_ee[14] < 0.02, "{:?}", state.base_from_ee);
    assert_stands(&mut robot);
    assert_waits_for_recovery(&mut robot);
    assert_eq!(robot.read_state().unwrap().cartesian_collision, [0.0; 6]);
}

#[test]
fn what_is_no_number_is_neither_sent_nor_followed() {
    let (_server, mut robot) = serve_panda();
    // The client rejects the number and stops the motion.
    let error = robot
        .control_joint_positions(InternalController::JointImpedance, |state, _| {
            let mut q = state.q_desired;
            q[2] = f64::NAN;
            ControlFlow::Continue(q)
        })
        .unwrap_err();
    assert_eq!(error.to_string(), "q: expected finite numbers, found NaN");
    assert_eq!(robot.read_state().unwrap().robot_mode, RobotMode::Idle);
    // The server rejects the number of a client without checks.
    for (controller, generator) in [
        (ControllerMode::JointImpedance, MotionGeneratorMode::JointPosition),
        (ControllerMode::JointImpedance, MotionGeneratorMode::JointVelocity),
        (ControllerMode::JointImpedance, MotionGeneratorMode::CartesianPosition),
        (ControllerMode::JointImpedance, MotionGeneratorMode::CartesianVelocity),
        (ControllerMode::External, MotionGeneratorMode::JointVelocity),
    ] {
        let before = robot.read_state().unwrap().q;
        let error = robot
            .control_unchecked(controller, generator, |_, _| {
                let nan = f64::NAN;
                let is_external = controller == ControllerMode::External;
                let dq = if is_external { [0.0; 7] } else { [nan; 7] };
                let motion = MotionCommand {
                    q: [nan; 7],
                    dq,
                    base_from_ee: [nan; 16],
                    twist: [nan; 6],
                    ..MotionCommand::default()
                };
                let command = RobotCommand { motion, torque: [nan; 7], ..RobotCommand::default() };
                Ok(Some(ControlFlow::Continue(command)))
            })
            .unwrap_err();
        assert!(!errors_of(&error).is_empty(), "{generator:?}: {error}");
        assert_waits_for_recovery(&mut robot);
        let after = robot.read_state().unwrap().q;
        assert!((0..7).all(|joint| (after[joint] - before[joint]).abs() < 2e-3), "{generator:?}: {before:?} {after:?}");
    }
}

#[test]
fn a_jump_of_a_radian_stops_the_arm() {
    let (_server, mut robot) = serve_panda();
    let start = robot.read_state().unwrap().q_desired;
    let mut num_states = 0;
    let error = robot
        .control_joint_positions(InternalController::JointImpedance, |_, _| {
            num_states += 1;
            let mut q = start;
            q[1] += if num_states > 100 { 1.0 } else { 0.0 };
            ControlFlow::Continue(q)
        })
        .unwrap_err();
    let line = error.to_string();
    let expected = "the motion was ended: stopped by a reflex; errors: joint_motion_generator_velocity_limits_violation, \
                    joint_motion_generator_velocity_discontinuity, joint_motion_generator_acceleration_discontinuity; ";
    assert!(line.starts_with(expected) && line.ends_with(" % of the last commands arrived in time"), "{line}");
    assert!((robot.read_state().unwrap().q[1] - start[1]).abs() < 2e-3);
    assert_waits_for_recovery(&mut robot);
}

#[test]
fn a_motion_must_end_at_rest() {
    let (_server, mut robot) = serve_panda();
    let mut ms = 0;
    let error = robot
        .control_joint_velocities(InternalController::JointImpedance, |_, step| {
            ms += step.as_millis() as u64;
            if ms < 300 { ControlFlow::Continue(velocity_after(ms)) } else { ControlFlow::Break(velocity_after(ms)) }
        })
        .unwrap_err();
    assert!(errors_of(&error).contains(&RobotError::JointMotionGeneratorAccelerationDiscontinuity), "{error}");
    assert_stands(&mut robot);
    assert_waits_for_recovery(&mut robot);
}

#[test]
fn a_server_that_goes_away_ends_the_motion_with_one_line() {
    let (server, mut robot) = serve_panda();
    let address = server.robot_address();
    let (mut server, mut ms) = (Some(server), 0);
    let begin = Instant::now();
    let error = robot
        .control_joint_velocities(InternalController::JointImpedance, |_, step| {
            ms += step.as_millis() as u64;
            if ms == 100 {
                drop(server.take());
            }
            ControlFlow::Continue([0.0; 7])
        })
        .unwrap_err();
    assert!(begin.elapsed() < Duration::from_secs(4));
    assert_eq!(error.to_string(), format!("{address} closed the connection"));
    assert!(!error.to_string().contains('\n'));
}

#[test]
fn another_thread_can_stop_a_motion() {
    let (_server, mut robot) = serve_panda();
    let handle = robot.stop_handle();
    let mut ms = 0;
    let error = robot
        .control_joint_velocities(InternalController::JointImpedance, |_, step| {
            ms += step.as_millis() as u64;
            if ms == 300 {
                handle.stop().unwrap();
            }
            ControlFlow::Continue(velocity_after(ms))
        })
        .unwrap_err();
    assert!(matches!(&error, FciError::Motion { status: Status::Preempted, .. }), "{error}");
    assert_stands(&mut robot);
    // A stop is not an error: the next motion may start.
    assert_eq!(robot.read_state().unwrap().robot_mode, RobotMode::Idle);
    robot
        .control_joint_positions(InternalController::JointImpedance, |state, _| ControlFlow::Break(state.q_desired))
        .unwrap();
}

#[test]
fn other_versions_are_refused_by_both_sides() {
    let (server, robot) = serve_panda();
    drop(robot);
    let (_client, response) = BareClient::connect(&server, 3);
    assert_eq!((response.status, &response.rest[..]), (Status::IncompatibleVersion, &[5, 0][..]));

    let (address, old_robot) = old_robot::serve();
    let error = Robot::connect(&address.to_string(), &RobotConfig::default()).unwrap_err();
    assert_eq!(error.to_string(), "the robot speaks version 4 of the protocol, expected 5 (Panda) or 10 (FR3)");
    old_robot.join().unwrap();
}

#[test]
fn a_second_client_is_turned_away_and_the_first_goes_on() {
    let (server, mut robot) = serve_panda();
    let error = Robot::connect(&server.robot_address().to_string(), &RobotConfig::default()).unwrap_err();
    assert_eq!(error.to_string(), format!("{} closed the connection", server.robot_address()));
    robot.read_state().unwrap();
}

#[test]
fn who_disconnects_may_connect_again_at_once() {
    let server = serve(Pace::LOCKSTEP, Limits::PANDA);
    for _ in 0..100 {
        connect(&server).read_state().unwrap();
        connect_hand(&server).read_state().unwrap();
    }
}

#[test]
fn a_hand_that_fails_or_is_stopped_says_so() {
    let (server, _robot) = serve_panda();
    let mut hand = connect_hand(&server);
    let handle = hand.stop_handle();
    let stopper = thread::spawn(move || {
        thread::sleep(Duration::from_millis(20));
        handle.stop().unwrap();
    });
    // 3 cm at 2 mm/s take 15 s of simulated time.
    let stopped = hand.move_to(0.05, 0.002);
    stopper.join().unwrap();
    assert_eq!(stopped.unwrap_err().to_string(), "hand: move: aborted");
    server.set_hand_failing(true);
    thread::sleep(Duration::from_millis(20));
    assert_eq!(hand.homing().unwrap_err().to_string(), "hand: homing: failed");
    server.set_hand_failing(false);
    thread::sleep(Duration::from_millis(20));
    assert!(hand.homing().unwrap());
}

#[test]
fn what_is_no_request_ends_the_connection_and_not_the_robot() {
    let server = serve(Pace::LOCKSTEP, Limits::PANDA);
    for bytes in [
        &[0xff; 12][..],
        &Header::message(HeaderKind::Robot, 99, 0, &[]),
        &Header::message(HeaderKind::Robot, 0, 0, &[1]),
        // This is a request before Connect.
        &Request::StopMove.encode(0, Version::V5).unwrap(),
    ] {
        let mut stream = TcpStream::connect(server.robot_address()).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(5))).unwrap();
        stream.write_all(bytes).unwrap();
        let end = read_message(&mut stream, HeaderKind::Robot);
        assert!(end.is_err(), "{end:?}");
    }
    let mut robot = connect(&server);
    assert_eq!(robot.read_state().unwrap().robot_mode, RobotMode::Idle);
}
