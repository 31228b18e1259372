//! Limits commands to the values that the robot accepts.
//!
//! # Source
//! `limitRate` of libfranka (`rate_limiting.h`), which limits each command relative to the robot's last reference.
//! After lost commands, that reference differs from the client's last command.

use crate::limits::Limits;
use crate::wire::RobotState;

/// One cycle in seconds.
const PERIOD_SECS: f64 = 1e-3;
/// Margin of commands below each limit (rad/s, rad/s², rad/s³), as in libfranka.
const MARGIN: f64 = 1e-3;
/// Number of lost commands for which velocities keep a margin, as in libfranka 0.9.2: the robot bridges lost commands
/// at constant acceleration and must stay within its limits.
const NUM_LOST_BEFORE_LIMIT: f64 = 3.0;

/// The joint positions (rad) nearest to `q` that the robot accepts after `state`. Velocity, acceleration and jerk are
/// within `limits`, and the velocity can stay within them in the next cycles; exceptions are joints 5 and 7 of an FR3
/// near their ends, where the velocity limit decreases faster than they may brake. Positions are not limited.
pub fn limit_joint_positions(limits: &Limits, state: &RobotState, q: &[f64; 7]) -> [f64; 7] {
    std::array::from_fn(|joint| {
        let (last_q, last_dq, last_ddq) = (state.q_desired[joint], state.dq_desired[joint], state.ddq_desired[joint]);
        let (max_acceleration, max_jerk) = (limits.acceleration[joint] - MARGIN, limits.jerk[joint] - MARGIN);
        let margin = MARGIN + NUM_LOST_BEFORE_LIMIT * PERIOD_SECS * max_acceleration;
        let [min_velocity, max_velocity] = limits.velocity_range(joint, last_q);
        let (min_velocity, max_velocity) = ((min_velocity + margin).min(0.0), (max_velocity - margin).max(0.0));
        let acceleration = ((q[joint] - last_q) / PERIOD_SECS - last_dq) / PERIOD_SECS;
        let step = max_jerk * PERIOD_SECS;
        // Near the velocity limit, the acceleration must be small enough to be reduced to zero before the limit.
        let braking = max_jerk / max_acceleration;
        let largest = (braking * (max_velocity - last_dq)).min(max_acceleration);
        let smallest = (braking * (min_velocity - last_dq)).max(-max_acceleration);
        let acceleration = acceleration.min(largest).max(smallest).clamp(-max_acceleration, max_acceleration);
        // Unlike in libfranka, the jerk is limited last: the velocity limit of an FR3 decreases towards a joint's end,
        // and following it at once would require a jerk beyond the limit. The margin of the velocity covers the delay.
        let acceleration = acceleration.clamp(last_ddq - step, last_ddq + step);
        last_q + (last_dq + acceleration * PERIOD_SECS) * PERIOD_SECS
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMITS: Limits = Limits::PANDA;

    /// Updates the state after the robot has accepted a position.
    fn accept(state: &mut RobotState, q: &[f64; 7]) -> [[f64; 7]; 2] {
        let (dq_before, ddq_before) = (state.dq_desired, state.ddq_desired);
        for joint in 0..7 {
            state.dq_desired[joint] = (q[joint] - state.q_desired[joint]) / PERIOD_SECS;
            state.ddq_desired[joint] = (state.dq_desired[joint] - dq_before[joint]) / PERIOD_SECS;
        }
        state.q_desired = *q;
        [state.ddq_desired, std::array::from_fn(|joint| (state.ddq_desired[joint] - ddq_before[joint]) / PERIOD_SECS)]
    }

    #[test]
    fn what_keeps_to_the_limits_is_sent_as_it_is() {
        let mut state = RobotState { q_desired: [0.1; 7], ..RobotState::default() };
        state.dq_desired[1] = 1.0;
        state.ddq_desired[1] = 3.0;
        let mut q = state.q_desired;
        // From 1 rad/s at 3 rad/s² to 1.004 rad/s: an acceleration of 4 rad/s² and a jerk of 1000 rad/s³.
        q[1] += 1.004e-3;
        let limited = limit_joint_positions(&LIMITS, &state, &q);
        assert!((0..7).all(|joint| (limited[joint] - q[joint]).abs() < 1e-15), "{limited:?}");
    }

    #[test]
    fn whatever_is_asked_for_each_step_keeps_to_every_limit() {
        for limits in [Limits::PANDA, Limits::FR3] {
            let mut state = RobotState { q_desired: [0.0, 0.0, 0.0, -1.5, 0.0, 1.5, 0.0], ..RobotState::default() };
            let (mut fastest, mut hardest) = ([0.0_f64; 7], [0.0_f64; 7]);
            for cycle in 0..6000 {
                // The commands move from one end of the ranges to the other and back, as fast as allowed.
                let goal = if cycle % 3000 < 1500 { limits.q_max } else { limits.q_min };
                let limited = limit_joint_positions(&limits, &state, &goal);
                let [ddq, jerk] = accept(&mut state, &limited);
                for joint in 0..7 {
                    let dq = state.dq_desired[joint];
                    let [min, max] = limits.velocity_range(joint, state.q_desired[joint]);
                    // The velocity limit of an FR3's joints 5 and 7 decreases near their ends faster than the joints
                    // may brake; only planning can avoid a violation.
                    let can_brake = limits.velocity_near_ends.is_none_or(|near| near[joint].slope < 20.0);
                    assert!(
                        !can_brake || (min..=max).contains(&dq),
                        "joint {joint} at {}: {dq}",
                        state.q_desired[joint]
                    );
                    assert!(ddq[joint].abs() <= limits.acceleration[joint], "joint {joint}: {}", ddq[joint]);
                    assert!(jerk[joint].abs() <= limits.jerk[joint], "joint {joint}: {}", jerk[joint]);
                    fastest[joint] = fastest[joint].max(dq.abs());
                    hardest[joint] = hardest[joint].max(ddq[joint].abs());
                }
            }
            // The motion comes close to the limits: an arm at rest would not pass the test.
            for joint in 0..7 {
                assert!(fastest[joint] > 0.9 * limits.velocity[joint], "joint {joint}: {}", fastest[joint]);
                assert!(hardest[joint] > 0.9 * limits.acceleration[joint], "joint {joint}: {}", hardest[joint]);
            }
        }
    }
}
