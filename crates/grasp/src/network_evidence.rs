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

use crate::network_calibration::{NetworkCalibration, log_odds};

/// A score this far below the threshold, in log-odds, does not speak against the part: by so much pictures score lower than
/// held-back samples (the housing's right places 3.7 in the median, and 5.5; docs/decisions/013-base-weights.md).
#[cfg(any(feature = "teach", test))]
const PICTURES_SCORE_LOWER_BY: f64 = 2.0;

/// How often the network was silent, unsure and sure, on the part and on other things.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct NetworkEvidence {
    on_part: [u32; 3],
    elsewhere: [u32; 3],
    /// How far below the threshold the network counts as sure, in log-odds; 0 in files of earlier versions.
    #[serde(default)]
    margin: f64,
}

impl NetworkEvidence {
    /// From the network's scores on the part and on other things, 0 where it proposes nothing.
    #[cfg(any(feature = "teach", test))]
    pub(crate) fn new(on_part: &[f64], elsewhere: &[f64], calibration: &NetworkCalibration) -> Self {
        let mut evidence = Self { margin: PICTURES_SCORE_LOWER_BY, ..Self::default() };
        for &score in on_part {
            evidence.on_part[evidence.class(score, calibration)] += 1;
        }
        for &score in elsewhere {
            evidence.elsewhere[evidence.class(score, calibration)] += 1;
        }
        evidence
    }

    /// The network's output at a place: nothing, something, or something not far below its threshold at least.
    fn class(&self, score: f64, calibration: &NetworkCalibration) -> usize {
        match score {
            0.0 => 0,
            score if log_odds(score) < log_odds(calibration.threshold) - self.margin => 1,
            _ => 2,
        }
    }

    /// ln of how much likelier such a score is on the part than elsewhere. Every class counts as seen once more than it was.
    pub(crate) fn log_likelihood_ratio(&self, score: f64, calibration: &NetworkCalibration) -> f64 {
        let class = self.class(score, calibration);
        let share = |counts: &[u32; 3]| f64::from(counts[class] + 1) / f64::from(counts.iter().sum::<u32>() + 3);
        (share(&self.on_part) / share(&self.elsewhere)).ln()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CALIBRATION: NetworkCalibration = NetworkCalibration { threshold: 0.8, slope: 10.0 };

    #[test]
    fn a_network_that_tells_the_part_counts_and_one_that_does_not_says_nothing() {
        let good = NetworkEvidence::new(&[0.9; 30], &[0.0; 30], &CALIBRATION);
        assert!((good.log_likelihood_ratio(0.95, &CALIBRATION) - 31f64.ln()).abs() < 1e-12);
        assert!((good.log_likelihood_ratio(0.0, &CALIBRATION) + 31f64.ln()).abs() < 1e-12);
        // Half a log-odds more than the margin below the threshold, and less.
        assert_eq!(good.log_likelihood_ratio(0.25, &CALIBRATION), 0.0);
        assert!(good.log_likelihood_ratio(0.4, &CALIBRATION) > 3.0);
        let poor = NetworkEvidence::new(&[0.9, 0.25, 0.0], &[0.9, 0.25, 0.0], &CALIBRATION);
        for score in [0.0, 0.25, 0.9] {
            assert_eq!(poor.log_likelihood_ratio(score, &CALIBRATION), 0.0);
            assert_eq!(NetworkEvidence::default().log_likelihood_ratio(score, &CALIBRATION), 0.0);
        }
    }
}
