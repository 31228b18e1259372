//! Number of rounds, and number of runs of each side per round.

/// Limits for the time of a measurement.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pace {
    /// Number of rounds, if the time allows.
    pub rounds: usize,
    /// Minimum number of rounds, even if the time does not allow them.
    pub min_rounds: usize,
    /// Minimum seconds of one side in a round: fast works run several times.
    pub turn_secs: f64,
    /// Time limit of all rounds, in seconds; the first `min_rounds` may exceed it.
    pub budget_secs: f64,
}

/// The plan of a work, from the times of its warm-ups.
#[derive(Debug, Clone, PartialEq)]
pub struct Rounds {
    pub rounds: usize,
    /// Number of runs of each side per round.
    pub repeats: Vec<usize>,
}

impl Pace {
    /// For published figures: all works take twelve minutes.
    pub const FULL: Self = Self { rounds: 7, min_rounds: 3, turn_secs: 0.5, budget_secs: 30.0 };
    /// For a quick look.
    pub const QUICK: Self = Self { rounds: 3, min_rounds: 1, turn_secs: 0.3, budget_secs: 10.0 };

    /// Makes a plan from the seconds of one run of each side.
    pub fn plan(&self, warm_ups: &[Option<f64>]) -> Rounds {
        let repeats: Vec<usize> = warm_ups
            .iter()
            .map(|seconds| seconds.map_or(1, |seconds| (self.turn_secs / seconds.max(1e-6)).ceil().min(500.0) as usize))
            .collect();
        let round: f64 = warm_ups.iter().zip(&repeats).map(|(secs, &count)| secs.unwrap_or(0.0) * count as f64).sum();
        let fit = (self.budget_secs / round.max(1e-6)) as usize;
        // A smaller number of rounds that the user requests takes precedence.
        let least = self.min_rounds.min(self.rounds);
        Rounds { rounds: fit.clamp(least, self.rounds), repeats }
    }

    /// A plan with one run of each side.
    pub fn once(&self, warm_ups: &[Option<f64>]) -> Rounds {
        Rounds { rounds: 1, repeats: vec![1; warm_ups.len()] }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PACE: Pace = Pace { rounds: 7, min_rounds: 3, turn_secs: 0.5, budget_secs: 30.0 };

    #[test]
    fn fast_works_fill_their_turn_and_slow_ones_have_few_rounds() {
        assert_eq!(PACE.plan(&[Some(0.01), Some(0.2)]), Rounds { rounds: 7, repeats: vec![50, 3] });
        // 2 + 4 s a round: five fit into 30 s.
        assert_eq!(PACE.plan(&[Some(2.0), Some(4.0)]), Rounds { rounds: 5, repeats: vec![1, 1] });
        assert_eq!(PACE.plan(&[Some(40.0), Some(60.0)]).rounds, 3);
        assert_eq!(PACE.plan(&[Some(0.0)]).repeats, [500]);
    }

    #[test]
    fn rounds_may_be_fewer_than_the_least_when_asked_for() {
        assert_eq!(Pace { rounds: 1, ..PACE }.plan(&[Some(0.1)]).rounds, 1);
    }
}
