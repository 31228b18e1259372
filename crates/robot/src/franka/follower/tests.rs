//! A robot that loses commands. Like a Panda, it continues at constant acceleration without a command. The tests
//! compare its reference with the limits, beyond which a Panda would end the motion.

use super::*;
use crate::safety::{CheckedMotion, SafetyLimits};
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;
use sdg_kinematics::{JointLimits, NUM_JOINTS, Trajectory, ready_pose};

/// A motion at the pace of rehearsals, the fastest one.
fn motion() -> CheckedMotion {
    let end = ready_pose() + JointVector::from([0.8, 0.2, -0.3, 0.3, 0.4, -0.2, 0.9]);
    let limits = JointLimits::panda().scaled(0.6, 0.4, 0.2).unwrap();
    SafetyLimits::default().check(Trajectory::point_to_point(&ready_pose(), &end, &limits).unwrap()).unwrap()
}

/// The robot's reference, and its largest derivatives as fractions of the limits.
struct SimulatedRobot {
    state: RobotState,
    max_shares: [f64; 3],
}

impl SimulatedRobot {
    fn at(q: JointVector) -> Self {
        let state = RobotState { q_desired: q.into(), ..RobotState::default() };
        Self { state, max_shares: [0.0; 3] }
    }

    /// Runs one cycle, with a command that arrived in time or without one.
    fn cycle(&mut self, command: Option<&JointVector>) {
        let state = &mut self.state;
        for idx in 0..NUM_JOINTS {
            let (q, dq, ddq) = (state.q_desired[idx], state.dq_desired[idx], state.ddq_desired[idx]);
            let extrapolated = q + (dq + ddq * PERIOD_SECS) * PERIOD_SECS;
            let next = command.map_or(extrapolated, |command| command[idx]);
            let next_dq = (next - q) / PERIOD_SECS;
            let next_ddq = if command.is_some() { (next_dq - dq) / PERIOD_SECS } else { ddq };
            let jerk = (next_ddq - ddq) / PERIOD_SECS;
            [state.q_desired[idx], state.dq_desired[idx], state.ddq_desired[idx]] = [next, next_dq, next_ddq];
            let limits = Limits::PANDA;
            let shares = [next_dq / limits.velocity[idx], next_ddq / limits.acceleration[idx], jerk / limits.jerk[idx]];
            for (max, share) in self.max_shares.iter_mut().zip(shares) {
                *max = max.max(share.abs());
            }
        }
        state.message_id += 1;
    }

    fn is_within_limits(&self) -> bool {
        self.max_shares.iter().all(|&share| share <= 1.0)
    }
}

/// Plays a motion; `is_lost` selects the commands that do not arrive, `is_unseen` the states that do not arrive.
fn play(
    follower: &mut Follower<'_>,
    robot: &mut SimulatedRobot,
    mut is_lost: impl FnMut(u64) -> bool,
    mut is_unseen: impl FnMut(u64) -> bool,
) -> JointVector {
    let mut last_id = robot.state.message_id;
    loop {
        let id = robot.state.message_id;
        assert!(id < 20_000, "the motion does not end");
        if is_unseen(id) {
            robot.cycle(None);
            continue;
        }
        let next = follower.next(&robot.state, id - last_id);
        last_id = id;
        match next {
            Next::Position(q) => robot.cycle((!is_lost(id)).then_some(&q)),
            Next::Last(q) => return q,
        }
    }
}

fn assert_ends_at(robot: &SimulatedRobot, motion: &CheckedMotion) {
    assert!(
        (JointVector::from(robot.state.q_desired) - motion.end()).amax() <= ARRIVED_RAD,
        "{:?}",
        robot.state.q_desired
    );
}

#[test]
fn without_losses_the_commands_are_the_trajectory_itself() {
    let motion = motion();
    let mut follower = Follower::new(Playback::new(&motion), Version::V5);
    let mut robot = SimulatedRobot::at(*motion.start());
    let mut last_id = 0;
    while let Next::Position(q) = follower.next(&robot.state, robot.state.message_id - last_id) {
        last_id = robot.state.message_id;
        robot.cycle(Some(&q));
        assert!((q - motion.sample(robot.state.message_id as f64 * PERIOD_SECS).0).amax() < 1e-12);
    }
    assert_eq!(follower.num_corrections(), 0);
    assert_ends_at(&robot, &motion);
    // The motion finishes a few cycles after its end, when the robot's reference is at rest.
    let num_cycles = (motion.duration_secs() / PERIOD_SECS).ceil() as u64;
    assert!((num_cycles..num_cycles + 5).contains(&robot.state.message_id), "{}", robot.state.message_id);
}

#[test]
fn nineteen_lost_commands_anywhere_are_made_up_for_within_every_limit() {
    let motion = motion();
    let duration_ms = (motion.duration_secs() / PERIOD_SECS) as u64;
    for by_state in [false, true] {
        for num_lost in [1, 2, 5, 10, 19] {
            for begin in (0..duration_ms).step_by(7) {
                let mut follower = Follower::new(Playback::new(&motion), Version::V5);
                let mut robot = SimulatedRobot::at(*motion.start());
                let is_in = |id: u64| (begin..begin + num_lost).contains(&id);
                // Either the commands are lost, or the states before them.
                play(&mut follower, &mut robot, |id| !by_state && is_in(id), |id| by_state && is_in(id));
                assert!(robot.is_within_limits(), "{num_lost} lost from {begin} on: {:?}", robot.max_shares);
                assert_ends_at(&robot, &motion);
                assert!(robot.state.message_id < duration_ms + 850, "{num_lost} lost from {begin} on");
            }
        }
    }
}

#[test]
fn a_line_that_loses_a_third_of_the_commands_keeps_to_the_limits() {
    let motion = motion();
    let mut num_corrections = 0;
    for seed in 0..200 {
        let mut rng = Pcg64Mcg::seed_from_u64(seed);
        let mut follower = Follower::new(Playback::new(&motion), Version::V5);
        let mut robot = SimulatedRobot::at(*motion.start());
        let mut gap_until = 0;
        let lost = |id: u64| {
            if id >= gap_until && rng.random_bool(0.08) {
                gap_until = id + rng.random_range(1..=10);
            }
            id < gap_until
        };
        play(&mut follower, &mut robot, lost, |_| false);
        num_corrections += follower.num_corrections();
        assert!(robot.is_within_limits(), "seed {seed}: {:?}", robot.max_shares);
        assert_ends_at(&robot, &motion);
    }
    // Where the trajectory's acceleration is constant, the robot continues as commanded, and nothing is corrected.
    assert!(num_corrections > 500, "{num_corrections}");
}

#[test]
fn a_start_beside_the_trajectorys_is_led_onto_it() {
    // The largest allowed distance of a motion's start from the controller's reference.
    let motion = motion();
    let mut follower = Follower::new(Playback::new(&motion), Version::V5);
    let mut robot = SimulatedRobot::at(motion.start() + JointVector::from_element(1e-3));
    play(&mut follower, &mut robot, |_| false, |_| false);
    assert!(robot.is_within_limits(), "{:?}", robot.max_shares);
    assert_ends_at(&robot, &motion);
}

#[test]
fn a_stop_after_a_loss_ends_at_rest_within_the_limits() {
    let motion = motion();
    for begin in (20..(motion.duration_secs() / PERIOD_SECS) as u64).step_by(13) {
        let mut follower = Follower::new(Playback::new(&motion), Version::V5);
        let mut robot = SimulatedRobot::at(*motion.start());
        let mut last_id = 0;
        loop {
            let id = robot.state.message_id;
            if id == begin + 12 {
                follower.stop();
            }
            let next = follower.next(&robot.state, id - last_id);
            last_id = id;
            match next {
                Next::Position(q) => robot.cycle((!(begin..begin + 12).contains(&id)).then_some(&q)),
                Next::Last(_) => break,
            }
        }
        assert!(robot.is_within_limits(), "{begin}: {:?}", robot.max_shares);
        let dq = JointVector::from(robot.state.dq_desired);
        assert!(dq.amax() < 1e-3 && robot.state.message_id < begin + 1500, "{dq}");
    }
}

#[test]
fn a_state_that_cannot_be_changes_no_command() {
    let motion = motion();
    for value in [f64::NAN, f64::INFINITY, 1.0] {
        let mut follower = Follower::new(Playback::new(&motion), Version::V5);
        let mut robot = SimulatedRobot::at(*motion.start());
        let mut last_id = 0;
        loop {
            let mut state = robot.state.clone();
            if (300..340).contains(&state.message_id) {
                state.q_desired[3] += value;
                state.dq_desired[3] += value * 1e3;
            }
            let next = follower.next(&state, state.message_id - last_id);
            last_id = state.message_id;
            let Next::Position(q) = next else { break };
            robot.cycle(Some(&q));
            assert!(state.message_id < 20_000);
        }
        assert!(robot.is_within_limits(), "{value}: {:?}", robot.max_shares);
        assert_ends_at(&robot, &motion);
    }
}

#[test]
fn a_number_of_a_state_that_leapt_ahead_takes_no_time() {
    let motion = motion();
    let mut follower = Follower::new(Playback::new(&motion), Version::V5);
    let robot = SimulatedRobot::at(*motion.start());
    follower.next(&robot.state, 0);
    let begun = std::time::Instant::now();
    follower.next(&robot.state, 1 << 60);
    assert!(begun.elapsed() < std::time::Duration::from_secs(10));
}
