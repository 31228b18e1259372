//! A relay that drops, repeats and changes data between robot and program: the arm continues, or it stops with an error
//! of one line.
//!
//! Faults of the programs at both ends are in network_faults.rs.

use std::time::{Duration, Instant};

use crate::network::relay::{self, ChangeState, PassCommand, unchanged};
use crate::network::{cell, serve, some_motion};
use sdg_fci::server::{Pace, Server};
use sdg_fci::wire::{RobotState, STATE_SIZE_V5};
use sdg_robot::{
    Arm, ArmMode, ArmState, FrankaArm, HandCommand, MAX_SILENCE_SECS, PERIOD_SECS, Robot, RobotError, STOP_SECS, Watch,
};
use sdg_simulation::{SharedPositions, Workcell};

/// Lockstep in which a command counts as lost if it has not arrived after 20 ms.
const LOCKSTEP: Pace = Pace::Lockstep { max_wait: Duration::from_millis(20) };
/// Number of the state or command of the motion at which a fault begins, while the arm moves.
const FAULT_AT: u64 = 500;
/// Maximum duration of a motion with a fault; a client that receives no new state gives up after 3 s.
const MAX_WAIT: Duration = Duration::from_secs(20);

fn all_pass() -> PassCommand {
    Box::new(|_| true)
}

/// Changes `num_states` states from [`FAULT_AT`] on.
fn changing(num_states: u64, mut change: impl FnMut(&mut RobotState) + Send + 'static) -> ChangeState {
    Box::new(move |number, state| {
        let mut state = state.clone();
        if (FAULT_AT..FAULT_AT + num_states).contains(&number) {
            change(&mut state);
        }
        vec![unchanged(&state)]
    })
}

struct Line {
    // The server runs until the end of the test.
    server: Server,
    positions: SharedPositions,
    arm: FrankaArm,
}

impl Line {
    fn new(change: ChangeState, pass: PassCommand) -> Self {
        let (server, positions) = serve(&cell("pendulum", 101), LOCKSTEP);
        let arm = relay::connect(&server, change, pass).unwrap();
        Self { server, positions, arm }
    }

    fn robot(&mut self) -> Robot<'_, FrankaArm> {
        Robot::new(&mut self.arm, Workcell::safety_limits(), Watch::default())
    }

    /// Runs a motion that ends with an error, and checks that nothing moves afterwards; returns the error's line and
    /// the observed states of the arm.
    fn stopped(&mut self) -> (String, Vec<ArmState>) {
        let positions = self.positions.clone();
        let mut robot = self.robot();
        let motion = some_motion(robot.arm());
        let begun = Instant::now();
        let error = robot.follow(motion.clone()).unwrap_err();
        assert!(begun.elapsed() < MAX_WAIT, "{:?}", begun.elapsed());
        let line = error.to_string();
        assert!(!line.contains('\n'), "{line}");
        assert!(matches!(robot.follow(motion), Err(RobotError::Latched(_))), "{line}");
        let open = HandCommand::Move { opening_m: 0.02, speed_m_s: 0.1 };
        assert!(matches!(robot.start_hand(open), Err(RobotError::Latched(_))), "{line}");
        let states = robot.watch().states().copied().collect();
        // First, the remaining motion of the stop decays; simulated time passes even if the client receives no states.
        self.let_time_pass();
        let before = positions.get();
        self.let_time_pass();
        let moved = before.iter().zip(positions.get()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(moved < 2e-3, "it moves by itself after \"{line}\": {moved}");
        (line, states)
    }

    fn let_time_pass(&mut self) {
        let _ = self.arm.wait(0.3, &mut Watch::default());
        std::thread::sleep(Duration::from_millis(300));
    }

    /// Checks that the motion reaches its end in spite of the relay.
    fn arrives(&mut self) {
        let mut robot = self.robot();
        let motion = some_motion(robot.arm());
        let end = *motion.end();
        robot.follow(motion).unwrap();
        assert!((robot.state().unwrap().q_commanded - end).amax() < 1e-4);
    }
}

/// Checks that the arm moves after the fault for no longer than a controlled stop takes.
fn assert_stops_in_time(states: &[ArmState], is_faulty: impl Fn(&ArmState) -> bool) {
    let fault = states.iter().find(|state| is_faulty(state)).expect("the fault was seen");
    let last = states.last().unwrap();
    assert!(last.time_secs - fault.time_secs <= STOP_SECS + 0.01, "{} s", last.time_secs - fault.time_secs);
    assert!(last.dq.amax() < 0.02, "{}", last.dq);
}

#[test]
fn a_position_that_is_no_number_stops_the_arm() {
    let mut line = Line::new(changing(20, |state| state.q[3] = f64::NAN), all_pass());
    let (text, states) = line.stopped();
    assert_eq!(text, "the arm was stopped: its state is implausible: joint 4 is at NaN");
    assert_stops_in_time(&states, |state| state.q[3].is_nan());
    assert_eq!(line.arm.state().unwrap().mode, ArmMode::Idle);
}

#[test]
fn a_position_that_jumps_by_a_radian_stops_the_arm() {
    let mut line = Line::new(changing(20, |state| state.q[3] += 1.0), all_pass());
    let (text, states) = line.stopped();
    assert!(text.starts_with("the arm was stopped: its state is implausible: joint 4 jumped by 1.0"), "{text}");
    assert_stops_in_time(&states, |state| state.q[3] - state.q_commanded[3] > 0.9);
    assert_eq!(line.arm.state().unwrap().mode, ArmMode::Idle);
}

#[test]
fn a_reference_that_cannot_be_stops_the_arm_and_is_not_followed() {
    for (value, expected) in [
        (f64::NAN, "the arm was stopped: its state is implausible: joint 4 is commanded to NaN"),
        (1.0, "the arm was stopped: its state is implausible: the reference of joint 4 jumped by 1.0"),
    ] {
        let mut line = Line::new(changing(20, move |state| state.q_desired[3] += value), all_pass());
        let (text, _) = line.stopped();
        assert!(text.starts_with(expected), "{text}");
        // The wrong reference led to no command: the motion ended without an error of the robot.
        assert_eq!(line.arm.state().unwrap().mode, ArmMode::Idle);
    }
}

/// Loses `num` states in a row.
fn lost(num: u64) -> ChangeState {
    Box::new(move |number, state| match (FAULT_AT..FAULT_AT + num).contains(&number) {
        true => Vec::new(),
        false => vec![unchanged(state)],
    })
}

#[test]
fn nineteen_lost_states_or_commands_are_made_up_for() {
    Line::new(lost(19), all_pass()).arrives();
    let passing: PassCommand = Box::new(|number| !(FAULT_AT..FAULT_AT + 19).contains(&number));
    let mut line = Line::new(Box::new(|_, state| vec![unchanged(state)]), passing);
    line.arrives();
    let statistics = line.server.statistics();
    assert!(statistics.num_motion_cycles - statistics.num_commands >= 19, "{statistics:?}");
}

#[test]
fn twenty_lost_states_or_commands_stop_the_arm() {
    let passing: PassCommand = Box::new(|number| !(FAULT_AT..FAULT_AT + 20).contains(&number));
    let by_commands = Line::new(Box::new(|_, state| vec![unchanged(state)]), passing);
    for mut line in [Line::new(lost(20), all_pass()), by_commands] {
        let (text, states) = line.stopped();
        assert!(text.starts_with("the arm stopped itself: communication_constraints_violation ("), "{text}");
        assert_eq!(line.arm.state().unwrap().mode, ArmMode::Reflex);
        assert!(states.len() > 400);
        // The robot's answer arrives before the states that the relay delays; a motion begins nevertheless.
        line.robot().recover().unwrap();
        line.arrives();
    }
}

#[test]
fn a_line_that_goes_dead_stops_the_arm_at_both_ends() {
    let mut line = Line::new(lost(u64::MAX / 2), Box::new(|number| number < FAULT_AT));
    let (text, states) = line.stopped();
    // The robot reports the end of the motion over TCP, which the relay still forwards.
    assert!(text.starts_with("the arm stopped itself: communication_constraints_violation ("), "{text}");
    let gaps = states.windows(2).map(|pair| pair[1].time_secs - pair[0].time_secs);
    assert!(gaps.fold(0.0, f64::max) <= MAX_SILENCE_SECS + PERIOD_SECS);
}

#[test]
fn repeated_and_late_states_change_nothing() {
    let mut before: Option<Vec<u8>> = None;
    let repeating: ChangeState = Box::new(move |_, state| {
        let datagram = unchanged(state);
        let earlier = before.replace(datagram.clone());
        // The previous datagram is repeated before each new one, which is sent twice.
        earlier.into_iter().chain([datagram.clone(), datagram]).collect()
    });
    Line::new(repeating, all_pass()).arrives();
}

#[test]
fn what_is_no_state_ends_the_motion() {
    for (length, expected) in [(100, "found 100"), (STATE_SIZE_V5 + 1, "a state of 2373 bytes")] {
        let broken: ChangeState = Box::new(move |number, state| {
            let mut datagram = unchanged(state);
            if number == FAULT_AT {
                datagram.resize(length, 0);
            }
            vec![datagram]
        });
        let mut line = Line::new(broken, all_pass());
        let (text, _) = line.stopped();
        assert!(text.starts_with("the connection to the robot at 127.0.0.1") && text.contains(expected), "{text}");
        // The robot received no more commands and stopped.
        assert_eq!(line.arm.state().unwrap().mode, ArmMode::Reflex);
    }
}

#[test]
fn a_number_of_a_state_that_leaps_ahead_ends_the_motion_soon() {
    let mut line = Line::new(changing(1, |state| state.message_id += 1 << 40), all_pass());
    let (text, _) = line.stopped();
    assert!(text.contains("no state that is newer than the last one") && text.contains("3"), "{text}");
}
