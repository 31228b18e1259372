//! Log-odds of a place from a network's proposal, or from having none.
//!
//! A network that was taught for half a minute also gives detections on other things, and misses parts: neither a proposal
//! nor its absence is strong evidence. How strong, is measured while teaching, on held-back samples:
//!
//! ```text
//! held-back samples with the part ─ places on the part ────────┐
//!                                                              ├─ the network's scores there, counted ─ likelihood ratio
//! samples without it ─ the place that agrees best with it ─────┘
//! ```

use serde::{Deserialize, Serialize};

use crate::calibration::Calibration;

/// How often the network was silent, unsure and sure, on the part and on other things.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub(crate) struct NetworkEvidence {
    on_part: [u32; 3],
    elsewhere: [u32; 3],
}

/// The network's output at a place: nothing, something below its threshold, or something above it.
fn class(score: f64, calibration: &Calibration) -> usize {
    match score {
        0.0 => 0,
        score if score < calibration.threshold => 1,
        _ => 2,
    }
}

impl NetworkEvidence {
    /// From the network's scores on the part and on other things, 0 where it proposes nothing.
    #[cfg(any(feature = "teach", test))]
    pub(crate) fn new(on_part: &[f64], elsewhere: &[f64], calibration: &Calibration) -> Self {
        let count = |scores: &[f64]| {
            let mut counts = [0; 3];
            scores.iter().for_each(|&score| counts[class(score, calibration)] += 1);
            counts
        };
        Self { on_part: count(on_part), elsewhere: count(elsewhere) }
    }

    /// ln of how much likelier such a score is on the part than elsewhere. Every class counts as seen once more than it was.
    pub(crate) fn log_likelihood_ratio(&self, score: f64, calibration: &Calibration) -> f64 {
        let class = class(score, calibration);
        let share = |counts: &[u32; 3]| f64::from(counts[class] + 1) / f64::from(counts.iter().sum::<u32>() + 3);
        (share(&self.on_part) / share(&self.elsewhere)).ln()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CALIBRATION: Calibration = Calibration { threshold: 0.8, slope: 10.0 };

    #[test]
    fn a_network_that_tells_the_part_counts_and_one_that_does_not_says_nothing() {
        let good = NetworkEvidence::new(&[0.9; 30], &[0.0; 30], &CALIBRATION);
        assert!((good.log_likelihood_ratio(0.95, &CALIBRATION) - 31f64.ln()).abs() < 1e-12);
        assert!((good.log_likelihood_ratio(0.0, &CALIBRATION) + 31f64.ln()).abs() < 1e-12);
        assert_eq!(good.log_likelihood_ratio(0.5, &CALIBRATION), 0.0);
        let poor = NetworkEvidence::new(&[0.9, 0.5, 0.0], &[0.9, 0.5, 0.0], &CALIBRATION);
        for score in [0.0, 0.5, 0.9] {
            assert_eq!(poor.log_likelihood_ratio(score, &CALIBRATION), 0.0);
            assert_eq!(NetworkEvidence::default().log_likelihood_ratio(score, &CALIBRATION), 0.0);
        }
    }
}
