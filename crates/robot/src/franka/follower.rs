//! The commands of a motion, for a robot that may lose some of them.
//!
//! ```text
//! robot's time since the last state ─ Playback ─ the trajectory's position at that time ─┐
//! state: q_d, dq_d, ddq_d ─ difference from the last command, reduced to zero smoothly ──┴ sum ─ rate limit ─ command
//! ```
//! A command that arrives too late is lost, and the robot continues without it at constant acceleration. The trajectory
//! follows the robot's clock, and the next command must lead from the robot's position back to the trajectory's
//! position at that time.

use sdg_fci::Limits;
use sdg_fci::client::limit_joint_positions;
use sdg_fci::wire::{RobotState, Version};
use sdg_kinematics::JointVector;

use super::correction::{Correction, Deviation};
use crate::arm_state::PERIOD_SECS;
use crate::playback::Playback;

/// A reference within this distance of the last command counts as equal to it, rad. Version 10 of the protocol has
/// single precision.
const SAME_RAD_V5: f64 = 1e-10;
const SAME_RAD_V10: f64 = 5e-7;
/// A reference slower than this is at rest, rad/s and rad/s².
const STANDING_RAD_S: f64 = 1e-4;
const STANDING_RAD_S2: f64 = 0.05;
/// A reference within this distance of the motion's end has arrived, rad: a hundredth of a millimetre at the tcp.
const ARRIVED_RAD: f64 = 1e-5;
/// Largest credible distance of a reference from the trajectory, rad. A robot that continues for 19 cycles without
/// commands is less than 0.01 rad from its trajectory, so that a distance above 0.1 rad is an error of the reported
/// state.
const MAX_DEVIATION_RAD: f64 = 0.1;
/// A robot that sent no state for longer than this, ms, has left the motion.
const MAX_ELAPSED_MS: u64 = 1000;
/// A motion is finished at the latest this number of cycles after the end of the trajectory.
const MAX_CYCLES_AFTER_END: u32 = 2000;

/// A motion's next command.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Next {
    /// Joint positions, rad.
    Position(JointVector),
    /// The last positions: the robot's reference is at rest at the end, or has not arrived within
    /// [`MAX_CYCLES_AFTER_END`].
    Last(JointVector),
}

/// Follows a motion by the robot's clock.
#[derive(Debug)]
pub(super) struct Follower<'a> {
    playback: Playback<'a>,
    limits: &'static Limits,
    same_rad: f64,
    /// The trajectory's last three positions, the newest first.
    trajectory: [JointVector; 3],
    sent: Option<JointVector>,
    correction: Option<Correction>,
    cycles_after_end: u32,
    num_corrections: u32,
}

impl<'a> Follower<'a> {
    /// Starts at the trajectory's start, with the limits of the robot for this protocol version.
    pub(super) fn new(playback: Playback<'a>, version: Version) -> Self {
        let start = *playback.start();
        let same_rad = match version {
            Version::V5 => SAME_RAD_V5,
            Version::V10 => SAME_RAD_V10,
        };
        Self {
            playback,
            limits: Limits::of(version),
            same_rad,
            trajectory: [start; 3],
            sent: None,
            correction: None,
            cycles_after_end: 0,
            num_corrections: 0,
        }
    }

    /// Starts a controlled stop on the path.
    pub(super) fn stop(&mut self) {
        self.playback.stop();
    }

    /// Number of states in which the robot was not at its commanded position.
    #[cfg(test)]
    pub(super) fn num_corrections(&self) -> u32 {
        self.num_corrections
    }

    /// The command that answers a state, `elapsed_ms` after the previous state by the robot's clock (0 for the first).
    pub(super) fn next(&mut self, state: &RobotState, elapsed_ms: u64) -> Next {
        let mut is_over = false;
        // The trajectory was already advanced to one cycle after the last state.
        for _ in 1..elapsed_ms.min(MAX_ELAPSED_MS) {
            is_over |= self.advance();
        }
        let reference = Deviation {
            q: JointVector::from(state.q_desired),
            dq: JointVector::from(state.dq_desired),
            ddq: JointVector::from(state.ddq_desired),
        };
        let is_as_sent = self.sent.is_some_and(|sent| (reference.q - sent).amax() <= self.same_rad);
        let is_credible = self.is_credible(&reference);
        if is_credible && !is_as_sent {
            let deviation = reference - self.on_trajectory();
            self.num_corrections += u32::from(self.sent.is_some());
            self.correction = Some(Correction::new(deviation, self.limits));
        }
        is_over |= self.advance();
        let offset = self.correction.as_mut().and_then(Correction::next);
        if offset.is_none() {
            self.correction = None;
        }
        let wanted = self.trajectory[0] + offset.unwrap_or_else(JointVector::zeros);
        // The limits are relative to the reference. If the reported reference is impossible, the command is not
        // limited.
        let limited = match is_credible {
            true => JointVector::from(limit_joint_positions(self.limits, state, &wanted.into())),
            false => wanted,
        };
        // Rounding does not count as limiting.
        let command = if (limited - wanted).amax() < 1e-12 { wanted } else { limited };
        // If the rate limit changed the command, the next cycle must compute a correction.
        self.sent = (command == wanted).then_some(command);
        self.cycles_after_end = if is_over { self.cycles_after_end + 1 } else { 0 };
        let is_standing = reference.dq.amax() < STANDING_RAD_S && reference.ddq.amax() < STANDING_RAD_S2;
        let has_arrived = is_standing && (reference.q - self.trajectory[0]).amax() <= ARRIVED_RAD;
        if is_over && (has_arrived || self.cycles_after_end > MAX_CYCLES_AFTER_END) {
            return Next::Last(command);
        }
        Next::Position(command)
    }

    /// Whether the reported state is possible for the robot.
    fn is_credible(&self, reference: &Deviation) -> bool {
        let [newest, ..] = self.trajectory;
        let is_near = (reference.q - newest).iter().all(|apart| apart.abs() <= MAX_DEVIATION_RAD);
        is_near && reference.dq.iter().chain(&reference.ddq).all(|value| value.is_finite())
    }

    /// Advances one cycle along the trajectory; returns whether it has ended.
    fn advance(&mut self) -> bool {
        let [newest, second, _] = self.trajectory;
        let next = self.playback.next_reference();
        self.trajectory = [next.map_or(newest, |reference| reference.q), newest, second];
        next.is_none()
    }

    /// The trajectory as the robot reports its reference: derivatives are differences over a cycle.
    fn on_trajectory(&self) -> Deviation {
        let [q, before, earlier] = self.trajectory;
        let (dq, dq_before) = ((q - before) / PERIOD_SECS, (before - earlier) / PERIOD_SECS);
        Deviation { q, dq, ddq: (dq - dq_before) / PERIOD_SECS }
    }
}

#[cfg(test)]
mod tests;
