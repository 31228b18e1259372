//! Compass search: one coordinate at a time, the step halved when no neighbour is better.

/// The stopping criteria of a search.
#[derive(Debug, Clone, Copy)]
pub struct CompassSearch {
    /// Initial step and smallest step, in the units of `neighbour`'s argument.
    pub steps: (f64, f64),
    /// Minimum gain of a move to a neighbour.
    pub min_gain: f64,
    /// Maximum number of rounds. A round has at most eight evaluations.
    pub max_rounds: usize,
    /// No round starts after this many evaluations.
    pub max_evaluations: usize,
}

impl CompassSearch {
    /// The best point found from `start` along four coordinates, and its score.
    ///
    /// `neighbour` moves a point along a coordinate by a positive or negative step; `None` if that move is not allowed.
    pub fn climb<P: Copy>(
        &self,
        start: P,
        neighbour: impl Fn(&P, usize, f64) -> Option<P>,
        score: impl Fn(&P) -> f64,
    ) -> (P, f64) {
        let (mut best, mut best_score) = (start, score(&start));
        let (mut step, mut num_evaluations) = (self.steps.0, 0);
        for _ in 0..self.max_rounds {
            if step < self.steps.1 || num_evaluations >= self.max_evaluations {
                break;
            }
            let mut is_better = false;
            for coordinate in 0..4 {
                for sign in [1.0, -1.0] {
                    let Some(next) = neighbour(&best, coordinate, sign * step) else { continue };
                    num_evaluations += 1;
                    let found = score(&next);
                    if found > best_score + self.min_gain {
                        (best, best_score, is_better) = (next, found, true);
                        break;
                    }
                }
            }
            if !is_better {
                step *= 0.5;
            }
        }
        (best, best_score)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn climbs_to_the_top_inside_the_bounds() {
        let search = CompassSearch { steps: (4.0, 0.01), min_gain: 0.0, max_rounds: usize::MAX, max_evaluations: 1000 };
        let moved = |point: &[f64; 4], k: usize, step: f64| {
            let mut next = *point;
            next[k] += step;
            (next[3] <= 1.0).then_some(next)
        };
        let score = |p: &[f64; 4]| -((p[0] - 3.0).powi(2) + (p[1] + 2.0).powi(2) + p[2].powi(2) + (p[3] - 5.0).powi(2));
        let (top, best) = search.climb([0.0; 4], moved, score);
        assert!((top[0] - 3.0).abs() < 0.02 && (top[1] + 2.0).abs() < 0.02 && top[2].abs() < 0.02, "{top:?}");
        assert_eq!((top[3], best), (1.0, score(&top)));
        // The limit of evaluations is checked between rounds of at most eight.
        let short = CompassSearch { max_evaluations: 1, ..search };
        assert!(short.climb([0.0; 4], moved, score).1 < best);
    }
}
