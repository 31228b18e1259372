//! The client of `sdg-fci` drives its server with MuJoCo, in lockstep: every generator and controller, and the limits
//! of limit_cases.

use std::f64::consts::PI;
use std::ops::ControlFlow;
use std::time::Duration;

use crate::fci_support::{connect, connect_hand, serve, serve_panda};
use crate::limit_cases;
use sdg_fci::client::{Answer, InternalController, Robot};
use sdg_fci::server::Pace;
use sdg_fci::wire::{Load, RobotMode, RobotState, Status};
use sdg_fci::{FciError, Limits, RobotError, isometry};
use sdg_kinematics::{ArmGeometry, JointVector};

/// Largest lag of the arm behind its reference in these slow motions: the stiffness of 3000 N·m/rad gives 0.3 mrad per
/// 1 N·m.
const LAG_RAD: f64 = 2e-3;
const LAG_M: f64 = 2e-3;

/// A value that moves from 0 to 1 and back, at rest at both ends.
fn swing(secs: f64, duration: f64) -> f64 {
    0.5 * (1.0 - (2.0 * PI * (secs / duration).min(1.0)).cos())
}

/// Measures the time of a motion, and checks that every state is a millisecond later than the previous one.
#[derive(Default)]
struct Clock {
    secs: f64,
    num_states: u64,
}

impl Clock {
    fn tick(&mut self, state: &RobotState, step: Duration) -> f64 {
        if self.num_states > 0 {
            assert_eq!(step, Duration::from_millis(1), "a state was missed");
            assert_eq!(state.control_command_success_rate, 1.0);
        }
        self.num_states += 1;
        self.secs += step.as_secs_f64();
        self.secs
    }
}

fn until<T>(value: T, secs: f64, duration: f64) -> Answer<T> {
    if secs < duration { ControlFlow::Continue(value) } else { ControlFlow::Break(value) }
}

fn largest_lag(state: &RobotState) -> f64 {
    (0..7).map(|joint| (state.q[joint] - state.q_desired[joint]).abs()).fold(0.0, f64::max)
}

#[test]
fn every_one_of_ten_thousand_commands_is_in_its_own_cycle() {
    let (server, mut robot) = serve_panda();
    let start = robot.read_state().unwrap().q_desired;
    let (mut clock, mut lag) = (Clock::default(), 0.0_f64);
    robot
        .control_joint_positions(InternalController::JointImpedance, |state, step| {
            let secs = clock.tick(state, step);
            lag = lag.max(largest_lag(state));
            let mut q = start;
            q[0] += 0.4 * swing(secs % 5.0, 5.0);
            q[3] -= 0.2 * swing(secs % 5.0, 5.0);
            until(q, secs, 10.0)
        })
        .unwrap();
    let statistics = server.statistics();
    assert!(statistics.num_commands > 10_000, "{statistics:?}");
    assert_eq!((statistics.num_commands, statistics.num_late), (statistics.num_motion_cycles, 0));
    assert!(lag < LAG_RAD, "{lag}");
    assert_eq!(robot.statistics().num_skipped, 0);
}

#[test]
fn every_generator_moves_the_arm_with_either_controller() {
    let (_server, mut robot) = serve_panda();
    for controller in [InternalController::JointImpedance, InternalController::CartesianImpedance] {
        let start = robot.read_state().unwrap().clone();

        let mut clock = Clock::default();
        let turned = robot
            .control_joint_velocities(controller, |state, step| {
                let secs = clock.tick(state, step);
                let mut dq = [0.0; 7];
                // The integral of half a sine of 0.3 rad/s over 1 s is 0.6 / pi.
                dq[4] = 0.3 * (PI * secs.min(1.0)).sin();
                until(dq, secs, 1.0)
            })
            .unwrap();
        assert!((turned.q[4] - start.q[4] - 0.6 / PI).abs() < LAG_RAD, "{:?}", turned.q);

        let (mut clock, from, mut furthest) = (Clock::default(), turned.base_from_ee_commanded, 0.0_f64);
        robot
            .control_poses(controller, |state, step| {
                let secs = clock.tick(state, step);
                furthest = furthest.max(state.base_from_ee[13] - from[13]);
                let mut pose = from;
                pose[13] += 0.08 * swing(secs, 2.0);
                until(pose, secs, 2.0)
            })
            .unwrap();
        assert!((furthest - 0.08).abs() < LAG_M, "{furthest}");

        let (mut clock, from) = (Clock::default(), isometry(&robot.read_state().unwrap().base_from_ee));
        let lowered = robot
            .control_twists(controller, |state, step| {
                let secs = clock.tick(state, step);
                until([0.0, 0.0, -0.05 * (PI * secs.min(1.0)).sin(), 0.0, 0.0, 0.0], secs, 1.0)
            })
            .unwrap();
        let to = isometry(&lowered.base_from_ee);
        assert!((from.translation.z - to.translation.z - 0.1 / PI).abs() < LAG_M, "{from} {to}");
        assert!(from.rotation.angle_to(&to.rotation) < 5e-3);
    }
}

#[test]
fn torques_move_the_arm_and_gravity_is_the_robots() {
    let (_server, mut robot) = serve_panda();
    let start = robot.read_state().unwrap().clone();
    // With commands of zero the arm floats in place.
    let mut clock = Clock::default();
    let floating = robot.control_torques(|state, step| until([0.0; 7], clock.tick(state, step), 1.0)).unwrap();
    let drift = (0..7).map(|joint| (floating.q[joint] - start.q[joint]).abs()).fold(0.0, f64::max);
    assert!(drift < 5e-3, "{drift}");
    // The client commands the torques of a spring.
    let mut clock = Clock::default();
    let moved = robot
        .control_torques(|state, step| {
            let secs = clock.tick(state, step);
            let goal = |joint: usize| start.q[joint] + if joint == 5 { 0.1 * swing(secs, 4.0) } else { 0.0 };
            until(
                std::array::from_fn(|joint| 100.0 * (goal(joint) - state.q[joint]) - 10.0 * state.dq[joint]),
                secs,
                2.0,
            )
        })
        .unwrap();
    assert!((moved.q[5] - start.q[5] - 0.1).abs() < 0.02, "{:?}", moved.q);
}

#[test]
fn a_load_that_is_not_told_of_is_felt_and_one_that_is_told_of_is_carried() {
    let (_server, mut robot) = serve_panda();
    // The load of 0.5 kg does not exist: its missing weight is measured as an external force of 4.9 N upwards.
    robot.set_load(&Load { mass: 0.5, center: [0.0, 0.0, 0.1], inertia: [0.0; 9] }).unwrap();
    assert_eq!(robot.read_state().unwrap().load_mass, 0.5);
    let start = robot.state().q_desired;
    let mut clock = Clock::default();
    let state = robot
        .control_joint_positions(InternalController::JointImpedance, |state, step| {
            until(start, clock.tick(state, step), 0.5)
        })
        .unwrap();
    assert!((state.external_wrench_in_base[2] - 4.905).abs() < 0.3, "{:?}", state.external_wrench_in_base);
}

#[test]
fn the_hand_homes_moves_and_tells_what_it_holds() {
    let (server, _robot) = serve_panda();
    let mut hand = connect_hand(&server);
    assert!(hand.homing().unwrap());
    assert!((hand.read_state().unwrap().width - 0.08).abs() < 1e-3);
    assert!(hand.move_to(0.02, 0.1).unwrap());
    assert!((hand.read_state().unwrap().width - 0.02).abs() < 1.5e-3);
    // Nothing is between the fingers.
    assert!(!hand.grasp(0.01, 0.05, 20.0, 0.005, 0.005).unwrap());
    assert!(!hand.read_state().unwrap().is_grasped);
    assert!(hand.stop().unwrap());
    let refused = hand.move_to(0.2, 0.1).unwrap_err();
    assert_eq!(refused.to_string(), "hand: move: failed");
}

#[test]
fn each_limit_stops_the_motion_outside_of_it_and_none_inside() {
    // Within the Cartesian limits the joints may exceed their limits: to test the Cartesian limits alone, the joints
    // get higher limits.
    let limits = Limits::PANDA;
    let agile = Limits {
        acceleration: limits.acceleration.map(|value| 3.0 * value),
        jerk: limits.jerk.map(|value| 3.0 * value),
        ..limits
    };
    // The server waits `max_wait` for each answer that the test omits.
    let pace = Pace::Lockstep { max_wait: Duration::from_millis(100) };
    for (limits_of_server, is_cartesian) in [(limits, false), (agile, true)] {
        let server = serve(pace, limits_of_server);
        let mut robot: Robot = connect(&server);
        let home = robot.read_state().unwrap().q_desired;
        assert!((0..7).all(|joint| (home[joint] - limit_cases::READY[joint]).abs() < 1e-6), "{home:?}");
        let mut cases = limit_cases::all(&limits);
        cases.retain(|case| case.is_cartesian() == is_cartesian);
        if !is_cartesian {
            cases.extend(limit_cases::joints_of_cartesian_motions(&limits));
        }
        for case in cases {
            for is_inside in [true, false] {
                let found = case.run(&mut robot, &home, is_inside).unwrap();
                assert!(case.is_expected(is_inside, &found), "{}, inside: {is_inside}: {found}", case.name);
                assert_eq!(robot.read_state().unwrap().robot_mode, RobotMode::Idle);
            }
        }
    }
}

/// Smallest singular value of the Jacobian at a configuration.
fn smallest_singular_value(q: &[f64; 7]) -> f64 {
    ArmGeometry::panda().jacobian(&JointVector::from(*q)).svd(false, false).singular_values.min()
}

#[test]
fn no_cartesian_motion_starts_at_a_singular_pose_and_one_does_just_beside_it() {
    /// The server's minimum, as in franka-sim.
    const MIN_SINGULAR_VALUE: f64 = 0.05;
    let (_server, mut robot) = serve_panda();
    let home = robot.read_state().unwrap().q_desired;
    // The arm is nearly stretched out.
    let mut stretched = home;
    (stretched[1], stretched[3], stretched[5]) = (0.0, -0.1, 1.6);
    let between = |share: f64| -> [f64; 7] {
        std::array::from_fn(|joint| home[joint] + share * (stretched[joint] - home[joint]))
    };
    assert!(smallest_singular_value(&home) > 0.06 && smallest_singular_value(&stretched) < 0.04);
    // Bisects the fraction of the path at which the smallest singular value reaches its allowed minimum.
    let (mut beside, mut singular) = (0.0, 1.0);
    while singular - beside > 1e-6 {
        let middle = 0.5 * (beside + singular);
        let is_beside = smallest_singular_value(&between(middle)) > MIN_SINGULAR_VALUE;
        *(if is_beside { &mut beside } else { &mut singular }) = middle;
    }
    for (share, is_refused) in [(beside - 0.002, false), (beside + 0.002, true)] {
        limit_cases::go_to(&mut robot, &between(share)).unwrap();
        let controller = InternalController::JointImpedance;
        let held = [
            robot.control_poses(controller, |state, _| ControlFlow::Break(state.base_from_ee_commanded)),
            robot.control_twists(controller, |_, _| ControlFlow::Break([0.0; 6])),
        ];
        for ended in held {
            match ended {
                Ok(_) => assert!(!is_refused, "at {share}"),
                Err(error) => {
                    assert!(is_refused, "{error}");
                    let FciError::Refused { status, .. } = &error else { panic!("{error}") };
                    assert_eq!(*status, Status::StartAtSingularPose);
                }
            }
        }
        // The refusal is not an error: joint motions are still possible.
        assert_eq!(robot.read_state().unwrap().robot_mode, RobotMode::Idle);
    }
    limit_cases::go_to(&mut robot, &home).unwrap();
}

#[test]
fn the_arm_stops_before_it_touches_itself() {
    let (_server, mut robot) = serve_panda();
    let home = robot.read_state().unwrap().q_desired;
    let mut folded = home;
    (folded[3], folded[5]) = (-3.0, 0.8);
    let error = limit_cases::go_to(&mut robot, &folded).unwrap_err();
    let FciError::Motion { errors, .. } = &error else { panic!("{error}") };
    assert!(errors.contains(RobotError::SelfCollisionAvoidanceViolation), "{error}");
    let stopped = robot.read_state().unwrap().q;
    robot.automatic_error_recovery().unwrap();
    let share = (stopped[3] - home[3]) / (folded[3] - home[3]);
    assert!((0.5..1.0).contains(&share), "{share}");
    // The arm may move out, to just before that point, but not in again.
    let just_before = std::array::from_fn(|joint| home[joint] + (share - 0.02) * (folded[joint] - home[joint]));
    limit_cases::go_to(&mut robot, &just_before).unwrap();
    let error = limit_cases::go_to(&mut robot, &folded).unwrap_err();
    assert!(error.to_string().contains("self_collision_avoidance_violation"), "{error}");
}
