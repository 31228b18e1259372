//! Counts the cycles of a motion that the client answered.

use std::collections::VecDeque;

/// Number of successive lost commands after which the robot stops.
pub const MAX_LOST_IN_A_ROW: u32 = 20;
/// Number of cycles that the success rate covers.
const WINDOW: usize = 100;
/// Maximum number of cycles before the first command: libfranka leaves some states unanswered while a motion starts.
/// The real value is not published; without a limit, a client that never answers would keep the robot in a motion
/// forever.
const MAX_CYCLES_TO_START: u32 = 200;

/// Counts the answers of one motion.
#[derive(Debug, Clone, Default)]
pub struct Communication {
    window: VecDeque<bool>,
    has_started: bool,
    lost_in_a_row: u32,
}

impl Communication {
    /// Records whether a cycle was answered.
    pub fn count(&mut self, is_answered: bool) {
        self.lost_in_a_row = if is_answered { 0 } else { self.lost_in_a_row + 1 };
        self.has_started |= is_answered;
        if !self.has_started {
            return;
        }
        if self.window.len() == WINDOW {
            self.window.pop_front();
        }
        self.window.push_back(is_answered);
    }

    /// Whether a command was received since the motion began.
    pub fn has_started(&self) -> bool {
        self.has_started
    }

    /// Whether the robot stops because of missing commands.
    pub fn is_violated(&self) -> bool {
        self.lost_in_a_row >= if self.has_started { MAX_LOST_IN_A_ROW } else { MAX_CYCLES_TO_START }
    }

    /// Fraction of the last cycles that were answered.
    pub fn success_rate(&self) -> f64 {
        let answered = self.window.iter().filter(|&&is_answered| is_answered).count();
        answered as f64 / self.window.len().max(1) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_twentieth_lost_command_stops_the_robot() {
        let mut communication = Communication::default();
        communication.count(true);
        for _ in 0..19 {
            communication.count(false);
        }
        assert!(!communication.is_violated());
        assert_eq!(communication.success_rate(), 0.05);
        communication.count(true);
        for _ in 0..20 {
            assert!(!communication.is_violated());
            communication.count(false);
        }
        assert!(communication.is_violated());
    }

    #[test]
    fn states_before_the_first_command_are_not_lost() {
        let mut communication = Communication::default();
        for _ in 0..MAX_CYCLES_TO_START - 1 {
            communication.count(false);
        }
        assert!(!communication.is_violated() && !communication.has_started());
        communication.count(true);
        assert_eq!(communication.success_rate(), 1.0);
    }
}
