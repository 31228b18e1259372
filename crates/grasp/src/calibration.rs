//! The network's score, calibrated so that 0.5 separates right from wrong without verification (`--no-verify`).
//!
//! ```text
//! network score ─ logistic, fitted on held-back augmentations ─ score of an unverified detection
//! ```
//! A verified detection is scored by all evidence ([`crate::verdict`]).

use serde::{Deserialize, Serialize};

use crate::decimal::decimal;

/// Maps a raw score to (0, 1) so that `threshold` becomes 0.5.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Calibration {
    /// The raw score that becomes 0.5.
    pub threshold: f64,
    /// Steepness: the logistic's slope, per unit of raw score.
    pub slope: f64,
}

/// How far from the wrong scores to the right ones the threshold stands when the two are apart. Below a half,
/// because pictures of the real workcell agree less than augmentations do, and wrong ones do not agree more. Chosen by that
/// reasoning, not measured.
const SHARE_OF_GAP: f64 = 0.4;
/// The logistic at the nearer end of the gap, which sets the slope. Chosen by hand, not measured.
const SCORE_AT_GAP_END: f64 = 0.88;
/// Bounds of the slope, so that a handful of scores makes neither a step nor a flat line. Chosen by that reasoning, not
/// measured; the upper one was 60 at first.
const SLOPE_BOUNDS: (f64, f64) = (4.0, 25.0);
/// Share of right scores that may lie below the lower end of the gap: one odd picture does not move the threshold. Chosen
/// by that reasoning, not measured.
const TRIMMED: f64 = 0.02;

impl Calibration {
    /// Leaves a score where it is, nearly: 0.5 stays 0.5. Derived: a logistic of slope 4 has slope 1 there.
    pub const NEUTRAL: Self = Self { threshold: 0.5, slope: 4.0 };

    /// Finds the threshold between the raw scores of right and wrong detections.
    ///
    /// When they overlap, the threshold is where the fewest are on the wrong side. `None` without a right score;
    /// without a wrong one, `no_wrong` stands for the highest of them.
    pub fn fit(right: &[f64], wrong: &[f64], no_wrong: f64) -> Option<Self> {
        let mut right: Vec<f64> = right.iter().copied().filter(|s| s.is_finite()).collect();
        let mut wrong: Vec<f64> = wrong.iter().copied().filter(|s| s.is_finite()).collect();
        right.sort_by(f64::total_cmp);
        wrong.sort_by(f64::total_cmp);
        let lowest_right = *right.get((right.len() as f64 * TRIMMED) as usize)?;
        let highest_wrong = wrong.last().copied().unwrap_or(no_wrong);
        let (threshold, half_gap) = if highest_wrong < lowest_right {
            let gap = lowest_right - highest_wrong;
            (highest_wrong + SHARE_OF_GAP * gap, SHARE_OF_GAP * gap)
        } else {
            (threshold_of_fewest_errors(&right, &wrong), 0.0)
        };
        let slope = (SCORE_AT_GAP_END / (1.0 - SCORE_AT_GAP_END)).ln() / half_gap.max(f64::MIN_POSITIVE);
        let slope = slope.clamp(SLOPE_BOUNDS.0, SLOPE_BOUNDS.1);
        Some(Self { threshold: decimal(threshold), slope: decimal(slope) })
    }

    /// The calibrated score, in (0, 1).
    pub fn apply(&self, raw: f64) -> f64 {
        1.0 / (1.0 + (-self.slope * (raw - self.threshold)).exp())
    }
}

/// The middle between two neighbouring scores that leaves the fewest right ones below and wrong ones above.
/// Both lists sorted upwards, `right` not empty.
fn threshold_of_fewest_errors(right: &[f64], wrong: &[f64]) -> f64 {
    let mut all: Vec<f64> = right.iter().chain(wrong).copied().collect();
    all.sort_by(f64::total_cmp);
    let errors = |threshold: f64| {
        let missed = right.partition_point(|&s| s < threshold);
        let false_alarms = wrong.len() - wrong.partition_point(|&s| s < threshold);
        missed + false_alarms
    };
    all.windows(2).map(|pair| 0.5 * (pair[0] + pair[1])).min_by_key(|&threshold| errors(threshold)).unwrap_or(all[0])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_threshold_stands_between_right_and_wrong() {
        let calibration = Calibration::fit(&[0.9, 0.92, 0.95], &[0.6, 0.7], 0.0).unwrap();
        // 0.7 + 0.4 · (0.9 - 0.7)
        assert!((calibration.threshold - 0.78).abs() < 1e-12);
        assert!((calibration.apply(0.78) - 0.5).abs() < 1e-12);
        assert!(calibration.apply(0.7) < 0.2 && calibration.apply(0.9) > 0.8);
    }

    #[test]
    fn overlapping_scores_get_the_fewest_errors() {
        let calibration = Calibration::fit(&[0.5, 0.8, 0.9], &[0.3, 0.6], 0.0).unwrap();
        // Between 0.6 and 0.8 one right score is lost; between 0.3 and 0.5 one wrong score passes. The lower comes first.
        assert!((calibration.threshold - 0.4).abs() < 1e-12);
    }

    #[test]
    fn nothing_right_is_no_calibration() {
        assert_eq!(Calibration::fit(&[], &[0.3], 0.0), None);
        assert_eq!(Calibration::fit(&[f64::NAN], &[], 0.0), None);
    }

    #[test]
    fn rises_with_the_raw_score() {
        let calibration = Calibration::NEUTRAL;
        let scores: Vec<f64> = (0..=10).map(|i| calibration.apply(f64::from(i) / 10.0)).collect();
        assert!(scores.windows(2).all(|pair| pair[0] < pair[1]));
    }
}
