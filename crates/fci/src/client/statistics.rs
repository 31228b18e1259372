//! The timing of a control loop.

use std::time::{Duration, Instant};

/// Longest gap between two states that is not a stall.
const STALL: Duration = Duration::from_millis(20);
/// Number of bins of answer times, one per microsecond; the last one counts all slower answers.
const NUM_BINS: usize = 5000;

/// Timing of one motion's control loop.
#[derive(Debug, Clone)]
pub struct ControlStatistics {
    /// Number of answered states.
    pub num_answers: u64,
    /// Number of states without an answer, lost or overtaken by a newer one; the robot sends one per millisecond.
    pub num_skipped: u64,
    /// Longest time between two states, by this computer's clock.
    pub max_gap: Duration,
    /// Number of gaps between two states longer than 20 ms.
    pub num_stalls: u64,
    /// Histogram of the answer times in microseconds, from receiving the state to having sent the command.
    answer_us: Vec<u32>,
    max_answer: Duration,
    last_received: Option<(Instant, u64)>,
}

impl Default for ControlStatistics {
    fn default() -> Self {
        Self {
            num_answers: 0,
            num_skipped: 0,
            max_gap: Duration::ZERO,
            num_stalls: 0,
            answer_us: vec![0; NUM_BINS],
            max_answer: Duration::ZERO,
            last_received: None,
        }
    }
}

impl ControlStatistics {
    /// Sets all counts to zero.
    pub(super) fn reset(&mut self) {
        self.answer_us.fill(0);
        *self = Self { answer_us: std::mem::take(&mut self.answer_us), ..Self::default() };
    }

    /// Records that a state has arrived.
    pub(super) fn received(&mut self, message_id: u64) {
        let now = Instant::now();
        if let Some((last, last_id)) = self.last_received {
            self.max_gap = self.max_gap.max(now - last);
            self.num_stalls += u64::from(now - last > STALL);
            self.num_skipped += message_id.saturating_sub(last_id + 1);
        }
        self.last_received = Some((now, message_id));
    }

    /// Records that the last state was answered.
    pub(super) fn answered(&mut self) {
        let Some((received, _)) = self.last_received else { return };
        let took = received.elapsed();
        self.num_answers += 1;
        self.max_answer = self.max_answer.max(took);
        self.answer_us[(took.as_micros() as usize).min(NUM_BINS - 1)] += 1;
    }

    /// The answer time, to the microsecond, within which the fraction `share` of the answers was sent; the slowest one
    /// for a fraction of 1.
    pub fn answer_time(&self, share: f64) -> Duration {
        let wanted = (share * self.num_answers as f64).ceil() as u64;
        let mut counted = 0;
        for (micros, &count) in self.answer_us.iter().enumerate().take(NUM_BINS - 1) {
            counted += u64::from(count);
            if counted >= wanted && share < 1.0 {
                return Duration::from_micros(micros as u64 + 1);
            }
        }
        self.max_answer
    }
}
