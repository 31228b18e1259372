//! The progress of a run, in [0, 1], from its steps, time budget and early stop.

use serde::{Deserialize, Serialize};

/// The reason for a run's end.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Ending {
    /// All steps were done.
    Completed,
    /// A validation was good enough.
    EarlyStop,
    /// The time budget was used up.
    TimeBudget,
    /// The observer requested a stop.
    Interrupted,
}

/// Progress of a run; drives the learning rate and the end.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Pace {
    steps: usize,
    budget_secs: Option<f64>,
    /// Step and progress at which a validation was good enough, and the number of steps from there
    /// to the end.
    cool_down: Option<(usize, f64, usize)>,
}

impl Pace {
    /// A run of `steps`, within `budget_secs` if given.
    pub(crate) fn new(steps: usize, budget_secs: Option<f64>) -> Self {
        Self { steps, budget_secs, cool_down: None }
    }

    /// Progress before `step`, `elapsed_secs` after the start.
    pub(crate) fn progress(&self, step: usize, elapsed_secs: f64) -> f64 {
        let by_steps = match self.cool_down {
            Some((from, reached, length)) => reached + (1.0 - reached) * (step - from) as f64 / length.max(1) as f64,
            None => step as f64 / self.steps as f64,
        };
        let by_time = self.budget_secs.map_or(0.0, |budget| elapsed_secs / budget);
        by_steps.max(by_time).min(1.0)
    }

    /// Ends the run `length` steps after `step`, unless it would end earlier anyway.
    pub(crate) fn start_cool_down(&mut self, step: usize, elapsed_secs: f64, length: usize) {
        if self.cool_down.is_none() && step + length < self.steps {
            self.cool_down = Some((step, self.progress(step, elapsed_secs), length));
        }
    }

    /// Number of steps of the run, as known now.
    pub(crate) fn planned_steps(&self) -> usize {
        self.cool_down.map_or(self.steps, |(from, _, length)| from + length)
    }

    /// The reason why the run is over before `step`, or `None` while it is not.
    pub(crate) fn ending(&self, step: usize, elapsed_secs: f64) -> Option<Ending> {
        if step >= self.planned_steps() {
            return Some(if self.cool_down.is_some() { Ending::EarlyStop } else { Ending::Completed });
        }
        self.budget_secs.filter(|&budget| elapsed_secs >= budget).map(|_| Ending::TimeBudget)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_moves_progress_when_it_is_further_on() {
        let pace = Pace::new(100, Some(10.0));
        assert_eq!(pace.progress(50, 2.0), 0.5);
        assert_eq!(pace.progress(50, 8.0), 0.8);
        assert_eq!(pace.ending(50, 10.0), Some(Ending::TimeBudget));
    }

    #[test]
    fn cool_down_brings_progress_to_one() {
        let mut pace = Pace::new(100, None);
        pace.start_cool_down(40, 0.0, 20);
        assert_eq!(pace.planned_steps(), 60);
        assert!((pace.progress(40, 0.0) - 0.4).abs() < 1e-12);
        assert!((pace.progress(50, 0.0) - 0.7).abs() < 1e-12);
        assert_eq!(pace.ending(60, 0.0), Some(Ending::EarlyStop));
        assert_eq!(pace.ending(59, 0.0), None);
    }

    #[test]
    fn cool_down_never_prolongs_a_run() {
        let mut pace = Pace::new(100, None);
        pace.start_cool_down(90, 0.0, 20);
        assert_eq!(pace.planned_steps(), 100);
        assert_eq!(pace.ending(100, 0.0), Some(Ending::Completed));
    }
}
