//! The network's score, calibrated so that 0.5 separates correct from wrong detections without verification
//! (`--no-verify`).
//!
//! ```text
//! network score ─ logistic, fitted on held-out augmentations ─ score of an unverified detection
//! ```
//! Scores are compared in log-odds, in which the scores of correct and of wrong detections each spread about their
//! median; probabilities accumulate near 0 and 1. A verified detection is scored by all evidence ([`crate::verdict`]).

use serde::{Deserialize, Serialize};

use sdg_geometry::{median, percentile};

use crate::decimal::decimal;

/// Maps a raw score to (0, 1) so that `threshold` becomes 0.5.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct NetworkCalibration {
    /// The raw score that is mapped to 0.5.
    pub threshold: f64,
    /// Steepness: the logistic's slope, per unit of the raw score's log-odds.
    pub slope: f64,
}

/// Scores are clamped to this distance from 0 and 1.
const MIN_PROBABILITY: f64 = 1e-4;
/// Minimum spread of the correct or of the wrong scores, in log-odds, because a few equal scores predict little about
/// later ones. Derived from this reason, not measured.
const MIN_SPREAD: f64 = 0.3;
/// The percentile that measures the spread: from below for correct scores, from above for wrong ones.
const FACING_PERCENT: f64 = 10.0;
/// Distance of this percentile of a normal distribution from the median, in standard deviations.
const FACING_DEVIATIONS: f64 = 1.281_551_6;
/// Ratio of two distances of the threshold, each in deviations: from the median of the wrong scores, and from that of
/// the correct ones. With normal distributions, 5 % of the wrong scores are accepted when 10 % of the correct ones are
/// refused (1.645 / 1.282).
const WRONG_PER_RIGHT_DEVIATION: f64 = 1.2836;
/// Bounds of the slope, so that a few scores give neither a step nor a flat line. Derived from this reason, not
/// measured.
const SLOPE_BOUNDS: (f64, f64) = (0.5, 4.0);

/// The log-odds of a raw score.
pub(crate) fn log_odds(raw: f64) -> f64 {
    let probability = raw.clamp(MIN_PROBABILITY, 1.0 - MIN_PROBABILITY);
    (probability / (1.0 - probability)).ln()
}

fn probability(log_odds: f64) -> f64 {
    1.0 / (1.0 + (-log_odds).exp())
}

impl NetworkCalibration {
    /// The calibration that leaves a score unchanged.
    pub const NEUTRAL: Self = Self { threshold: 0.5, slope: 1.0 };

    /// Finds the threshold between the raw scores of correct and wrong detections, from its distances to the medians of
    /// both, in deviations. The deviation of each side is measured towards the other side, so that single outliers and
    /// scores far from the threshold do not move the threshold.
    ///
    /// `None` without a correct score; `no_wrong` is used if there is no wrong score. `usual` is the usual threshold of
    /// networks of this kind, in log-odds, if it is known. Samples of a few other objects predict little about later
    /// ones; therefore the threshold is at least `usual`, and a higher threshold is moved half-way to `usual`.
    pub fn fit(right: &[f64], wrong: &[f64], no_wrong: f64, usual: Option<f64>) -> Option<Self> {
        let in_log_odds = |scores: &[f64]| -> Vec<f64> {
            scores.iter().copied().filter(|score| score.is_finite()).map(log_odds).collect()
        };
        let (right, mut wrong) = (in_log_odds(right), in_log_odds(wrong));
        if wrong.is_empty() {
            wrong.push(log_odds(no_wrong));
        }
        let spread = |scores: &[f64], percent: f64| {
            let median = median(scores.iter().copied())?;
            let facing = percentile(scores.iter().copied(), percent)?;
            Some((median, ((facing - median).abs() / FACING_DEVIATIONS).max(MIN_SPREAD)))
        };
        let (right, of_right) = spread(&right, FACING_PERCENT)?;
        let (wrong, of_wrong) = spread(&wrong, 100.0 - FACING_PERCENT)?;
        let weight = WRONG_PER_RIGHT_DEVIATION * of_wrong;
        let threshold = (right * weight + wrong * of_right) / (weight + of_right);
        let threshold = usual.map_or(threshold, |usual| threshold.max(usual).midpoint(usual));
        // The most likely slope of the logistic for two normal distributions of equal deviation.
        let deviation = 0.5 * (of_right + of_wrong);
        let slope = ((right - wrong) / deviation.powi(2)).clamp(SLOPE_BOUNDS.0, SLOPE_BOUNDS.1);
        Some(Self { threshold: decimal(probability(threshold)), slope: decimal(slope) })
    }

    /// The calibrated score, in (0, 1).
    pub fn apply(&self, raw: f64) -> f64 {
        probability(self.slope * (log_odds(raw) - log_odds(self.threshold)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neutral_leaves_a_score_and_the_threshold_becomes_a_half() {
        for raw in [0.01, 0.3, 0.5, 0.97] {
            assert!((NetworkCalibration::NEUTRAL.apply(raw) - raw).abs() < 1e-12);
        }
        let calibration = NetworkCalibration { threshold: 0.83, slope: 2.0 };
        assert!((calibration.apply(0.83) - 0.5).abs() < 1e-12);
        let scores: Vec<f64> = (0..=10).map(|i| calibration.apply(f64::from(i) / 10.0)).collect();
        assert!(scores.windows(2).all(|pair| pair[0] < pair[1]), "{scores:?}");
    }

    /// Scores of these log-odds.
    fn scores(log_odds: &[f64]) -> Vec<f64> {
        log_odds.iter().map(|value| probability(*value)).collect()
    }

    #[test]
    fn the_threshold_lies_nearer_to_the_scores_that_are_spread_less() {
        let right = scores(&[2.4, 2.6, 2.8, 3.0, 3.2, 3.4, 3.6]);
        let wrong = scores(&[-9.0, -8.0, -3.0, -1.0, 0.0, 0.5, 1.0]);
        let calibration = NetworkCalibration::fit(&right, &wrong, 0.0, None).unwrap();
        let threshold = log_odds(calibration.threshold);
        assert!((1.0..2.4).contains(&threshold), "{threshold}");
        assert!(3.0 - threshold < threshold + 1.0);
        assert!(right.iter().all(|&raw| calibration.apply(raw) > 0.5));
        assert!(wrong.iter().all(|&raw| calibration.apply(raw) < 0.5));
    }

    #[test]
    fn one_odd_picture_of_many_moves_it_little() {
        let mut right: Vec<f64> = (0..30).map(|i| probability(2.0 + f64::from(i) / 30.0)).collect();
        let wrong: Vec<f64> = (0..30).map(|i| probability(-3.0 + f64::from(i) / 10.0)).collect();
        let threshold = |right: &[f64]| log_odds(NetworkCalibration::fit(right, &wrong, 0.0, None).unwrap().threshold);
        let before = threshold(&right);
        right[0] = probability(-5.0);
        assert!((threshold(&right) - before).abs() < 0.1);
    }

    #[test]
    fn the_threshold_is_not_below_the_usual_one_and_half_way_to_it_from_above() {
        let (right, wrong) = (scores(&[4.0, 5.0, 6.0]), scores(&[0.0, 1.0, 2.0]));
        let threshold = |usual| log_odds(NetworkCalibration::fit(&right, &wrong, 0.0, usual).unwrap().threshold);
        assert!((threshold(Some(1.0)) - 0.5 * (threshold(None) + 1.0)).abs() < 1e-3);
        assert!((threshold(Some(4.5)) - 4.5).abs() < 1e-3);
    }

    #[test]
    fn nothing_right_is_no_calibration_and_nothing_wrong_is_one() {
        assert_eq!(NetworkCalibration::fit(&[], &[0.3], 0.1, None), None);
        assert_eq!(NetworkCalibration::fit(&[f64::NAN], &[], 0.1, None), None);
        let calibration = NetworkCalibration::fit(&[0.9, 0.92, 0.95], &[], 0.1, None).unwrap();
        assert!(calibration.apply(0.9) > 0.8 && calibration.apply(0.1) < 0.2, "{calibration:?}");
    }
}
