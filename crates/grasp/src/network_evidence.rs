//! Log-odds of a place from a network's box there, or from the absence of a box.
//!
//! A network that was taught for half a minute also detects other objects and misses parts, so that neither a box nor
//! its absence is strong evidence. The strength of this evidence is measured on held-out samples during teaching:
//!
//! ```text
//! held-out samples with the part ── places on the part ────────┐
//!                                                              ├─ the network's scores there, counted ─ likelihood ratio
//! samples without it ─ the place that agrees best with it ─────┘
//! ```

use serde::{Deserialize, Serialize};

use crate::network_calibration::{NetworkCalibration, log_odds};

/// A score at most this far below the threshold, in log-odds, does not speak against the part: pictures score lower
/// than held-out samples by about this much (the correct places of the housing had a median score of 3.7 in pictures
/// and 5.5 in held-out samples; docs/decisions/013-base-weights.md).
#[cfg(any(feature = "teach", test))]
const PICTURES_SCORE_LOWER_BY: f64 = 2.0;

/// Counts of the network's outputs (no box, unsure, sure) on the part and on other objects.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct NetworkEvidence {
    on_part: [u32; 3],
    elsewhere: [u32; 3],
    /// Distance below the threshold, in log-odds, at which the network still counts as sure; 0 in files of earlier
    /// versions.
    #[serde(default)]
    margin: f64,
}

impl NetworkEvidence {
    /// Counts the network's scores on the part and on other objects; a score is 0 without a box.
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

    /// The network's output at a place: none, a low score, or a score of at least the threshold minus the margin.
    fn class(&self, score: f64, calibration: &NetworkCalibration) -> usize {
        match score {
            0.0 => 0,
            score if log_odds(score) < log_odds(calibration.threshold) - self.margin => 1,
            _ => 2,
        }
    }

    /// ln of the ratio of two likelihoods of the score's class, on the part and elsewhere. Every count is increased by
    /// one.
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
        // In log-odds, 0.25 is 2.5 below the threshold and 0.4 is 1.8 below it; the margin lies between.
        assert_eq!(good.log_likelihood_ratio(0.25, &CALIBRATION), 0.0);
        assert!(good.log_likelihood_ratio(0.4, &CALIBRATION) > 3.0);
        let poor = NetworkEvidence::new(&[0.9, 0.25, 0.0], &[0.9, 0.25, 0.0], &CALIBRATION);
        for score in [0.0, 0.25, 0.9] {
            assert_eq!(poor.log_likelihood_ratio(score, &CALIBRATION), 0.0);
            assert_eq!(NetworkEvidence::default().log_likelihood_ratio(score, &CALIBRATION), 0.0);
        }
    }
}
