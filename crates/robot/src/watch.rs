//! The checks of every state of a moving arm, and the states of the last second.

use std::collections::VecDeque;
use std::fmt;

use sdg_kinematics::{JointLimits, JointVector, NUM_JOINTS};

use crate::arm_state::{ArmMode, ArmState};

/// Reasons for ending a motion early.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum StopReason {
    /// A person requested the stop.
    Interrupted,
    /// The arm reported an impossible state.
    Implausible(String),
    /// By the arm's clock, two states were farther apart than allowed ([`MAX_SILENCE_SECS`] or
    /// [`Watch::allow_silence`]), or a motion did not end.
    Watchdog(String),
    /// The arm's controller is in a mode in which it does not move.
    Mode(ArmMode),
}

impl fmt::Display for StopReason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Interrupted => f.write_str("a person requested it"),
            Self::Implausible(what) => write!(f, "its state is implausible: {what}"),
            Self::Watchdog(what) => write!(f, "watchdog: {what}"),
            Self::Mode(mode) => write!(f, "the arm is in mode \"{}\"", mode.name()),
        }
    }
}

/// The longest gap between two states of a moving arm, in seconds of its clock: the gap that Franka's controller itself
/// bridges.
pub const MAX_SILENCE_SECS: f64 = 0.020;
/// Allowance for rounding: states are a whole number of milliseconds apart.
const ROUNDING_SECS: f64 = 0.5e-3;
/// Length of the kept history, in seconds of the arm's clock.
pub const HISTORY_SECS: f64 = 1.0;
/// Largest speed of a joint between two states, as a multiple of its limit; [`NOISE_RAD`] is allowed in addition.
const MAX_SPEED_SHARE: f64 = 2.0;
const NOISE_RAD: f64 = 0.005;

/// Called for each state until there is a reason to stop, and before motions; returns the reason if the arm must stop.
pub type StopRequest = Box<dyn FnMut() -> Option<StopReason> + Send>;

/// Checks every state of a moving arm.
pub struct Watch {
    request: StopRequest,
    states: VecDeque<ArmState>,
    stop: Option<StopReason>,
    max_silence_secs: f64,
    /// Velocity limits of the arm's joints, rad/s.
    velocity_max: JointVector,
}

impl fmt::Debug for Watch {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Watch").field("num_states", &self.states.len()).field("stop", &self.stop).finish()
    }
}

impl Default for Watch {
    /// A watch without a stop request.
    fn default() -> Self {
        Self::new(Box::new(|| None))
    }
}

impl Watch {
    /// A watch that asks `request` for reasons to stop.
    pub fn new(request: StopRequest) -> Self {
        let velocity_max = JointLimits::panda().velocity_max;
        Self { request, states: VecDeque::new(), stop: None, max_silence_secs: MAX_SILENCE_SECS, velocity_max }
    }

    /// Allows longer gaps between states than [`MAX_SILENCE_SECS`], for an arm whose driver sends fewer states.
    pub fn allow_silence(&mut self, max_silence_secs: f64) {
        self.max_silence_secs = max_silence_secs;
    }

    /// Uses the velocity limits of an arm instead of the Panda's for the plausibility of states.
    pub(crate) fn of_arm(self, limits: &JointLimits) -> Self {
        Self { velocity_max: limits.velocity_max, ..self }
    }

    /// Starts another motion: the time since the last state does not count as a gap.
    pub(crate) fn begin(&mut self) {
        self.stop = None;
        if let Some(state) = self.states.back_mut() {
            // A state is compared only with a previous one in mode `Moving`.
            state.mode = ArmMode::Idle;
        }
    }

    /// Checks a state; returns the reason to stop, if there is one. Later calls return the first reason.
    pub fn observe(&mut self, state: &ArmState) -> Option<&StopReason> {
        if self.stop.is_none() {
            self.stop = self.implausible(state).or_else(|| (self.request)());
        }
        while self.states.front().is_some_and(|first| state.time_secs - first.time_secs > HISTORY_SECS) {
            self.states.pop_front();
        }
        self.states.push_back(*state);
        self.stop.as_ref()
    }

    /// Asks whether a person or a program requests a stop.
    pub fn is_stop_requested(&mut self) -> Option<StopReason> {
        (self.request)()
    }

    fn implausible(&self, state: &ArmState) -> Option<StopReason> {
        let quantities = [(state.q, "is at"), (state.dq, "moves at"), (state.q_commanded, "is commanded to")];
        for (values, verb) in quantities {
            if let Some(joint_idx) = (0..NUM_JOINTS).find(|&idx| !values[idx].is_finite()) {
                let (joint, value) = (joint_idx + 1, values[joint_idx]);
                return Some(StopReason::Implausible(format!("joint {joint} {verb} {value}")));
            }
        }
        let before = self.states.back().filter(|before| before.mode == ArmMode::Moving)?;
        let elapsed_secs = state.time_secs - before.time_secs;
        if elapsed_secs > self.max_silence_secs + ROUNDING_SECS {
            return Some(StopReason::Watchdog(format!(
                "no state of the arm for {:.0} ms, at most {:.0} ms are allowed",
                elapsed_secs * 1e3,
                self.max_silence_secs * 1e3
            )));
        }
        let allowed = self.velocity_max * (MAX_SPEED_SHARE * elapsed_secs.max(0.0));
        let jump = |now: &JointVector, before: &JointVector, what: &str| {
            let moved = (now - before).abs();
            let joint_idx = (0..NUM_JOINTS).find(|&idx| moved[idx] > allowed[idx] + NOISE_RAD)?;
            let (joint, moved_rad, elapsed_ms) = (joint_idx + 1, moved[joint_idx], elapsed_secs * 1e3);
            Some(StopReason::Implausible(format!(
                "{what}{joint} jumped by {moved_rad:.3} rad within {elapsed_ms:.0} ms"
            )))
        };
        jump(&state.q, &before.q, "joint ")
            .or_else(|| jump(&state.q_commanded, &before.q_commanded, "the reference of joint "))
    }

    /// The states of the last second, oldest first.
    pub fn states(&self) -> impl ExactSizeIterator<Item = &ArmState> {
        self.states.iter()
    }

    /// The states of the last second as CSV, with a header line.
    pub fn states_csv(&self) -> String {
        use std::fmt::Write as _;
        let mut text = String::from("time_secs,mode");
        for name in ["q_rad", "dq_rad_s", "q_commanded_rad", "tau_external_nm"] {
            for joint in 1..=NUM_JOINTS {
                let _ = write!(text, ",{name}_{joint}");
            }
        }
        text.push('\n');
        for state in &self.states {
            let _ = write!(text, "{:.3},{}", state.time_secs, state.mode.name());
            for values in [&state.q, &state.dq, &state.q_commanded, &state.tau_external_nm] {
                for value in values.iter() {
                    let _ = write!(text, ",{value:.6}");
                }
            }
            text.push('\n');
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sdg_kinematics::ready_pose;

    fn state(time_secs: f64, q: JointVector) -> ArmState {
        let zero = JointVector::zeros();
        ArmState { time_secs, q, dq: zero, q_commanded: q, tau_external_nm: zero, mode: ArmMode::Moving }
    }

    #[test]
    fn a_jump_a_gap_and_what_is_no_number_are_reasons_to_stop() {
        let mut jumped = ready_pose();
        jumped[2] += 1.0;
        let mut nan = ready_pose();
        nan[4] = f64::NAN;
        let led_to = |q_commanded| ArmState { q_commanded, ..state(0.001, ready_pose()) };
        for (second, expected) in [
            (state(0.001, jumped), "joint 3 jumped by 1.000 rad within 1 ms"),
            (state(0.001, nan), "joint 5 is at NaN"),
            (led_to(jumped), "the reference of joint 3 jumped by 1.000 rad within 1 ms"),
            (led_to(nan), "joint 5 is commanded to NaN"),
            (state(0.050, ready_pose()), "no state of the arm for 50 ms"),
        ] {
            let mut watch = Watch::default();
            assert_eq!(watch.observe(&state(0.0, ready_pose())), None);
            let found = watch.observe(&second).unwrap().to_string();
            assert!(found.contains(expected), "{found}");
            // A later state does not clear the reason.
            assert!(watch.observe(&state(0.051, ready_pose())).is_some());
        }
    }

    #[test]
    fn longer_gaps_are_allowed_where_a_driver_sends_few_states() {
        let mut watch = Watch::default();
        watch.allow_silence(0.1);
        assert_eq!(watch.observe(&state(0.0, ready_pose())), None);
        assert_eq!(watch.observe(&state(0.1, ready_pose())), None);
        assert!(watch.observe(&state(0.25, ready_pose())).unwrap().to_string().contains("at most 100 ms"));
    }

    #[test]
    fn nineteen_states_in_a_row_may_be_lost() {
        for (cycle, is_stopped) in [(20, false), (21, true)] {
            let mut watch = Watch::default();
            assert_eq!(watch.observe(&state(0.480, ready_pose())), None);
            let later = watch.observe(&state(0.480 + f64::from(cycle) * 1e-3, ready_pose()));
            assert_eq!(later.is_some(), is_stopped, "{later:?}");
        }
    }

    #[test]
    fn a_second_of_states_is_kept_and_written() {
        let mut watch = Watch::default();
        for cycle in 0..3000 {
            assert_eq!(watch.observe(&state(f64::from(cycle) * 1e-3, ready_pose())), None);
        }
        assert!((1000..=1002).contains(&watch.states().len()), "{}", watch.states().len());
        let csv = watch.states_csv();
        assert_eq!(csv.lines().count(), watch.states().len() + 1);
        assert!(csv.lines().all(|line| line.split(',').count() == 30), "{}", csv.lines().next().unwrap());
        assert!(csv.lines().last().unwrap().starts_with("2.999,moving,0.000000,-0.785398"));
    }

    #[test]
    fn whoever_asks_stops_the_arm() {
        let mut cycles = 0;
        let mut watch = Watch::new(Box::new(move || {
            cycles += 1;
            (cycles > 3).then_some(StopReason::Interrupted)
        }));
        let stopped = (0..10).position(|cycle| watch.observe(&state(f64::from(cycle) * 1e-3, ready_pose())).is_some());
        assert_eq!(stopped, Some(3));
    }
}
