//! The accuracy of a detector on samples on which it was not trained, in pixels of the demonstration and degrees.
//!
//! Errors are given in pixels **of the demonstration**, because pixels of the training image depend on its size: in the
//! demonstration, the millimetres per pixel depend only on the camera and its height.

use sdg_geometry::{Angle, PlanarGrasp, median, percentile};
use serde::{Deserialize, Serialize};

/// Maximum distance of a hit from the ground truth, in demonstration pixels. With the paper's camera (550 px focal
/// length, 0.6 m above the table) it corresponds to 10 mm; with other cameras to another length.
pub const HIT_PX: f64 = 9.2;
/// Maximum angle error of a hit, in degrees.
pub const HIT_DEGREES: f64 = 10.0;
/// False alarms are counted from the score that this percentage of the hits do not exceed: a score has no meaning
/// before it is calibrated, and the calibrated threshold rejects about as many hits.
const REFUSED_PERCENT: f64 = 10.0;
/// The score from which false alarms are counted if there was no hit.
const NO_HIT_SCORE: f64 = 0.5;

/// The detector's result for one held-out sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Outcome {
    /// The part was present and was detected.
    Found {
        /// Distance between the grasp's centre and the ground truth, in demonstration pixels.
        error_px: f64,
        /// Angle between the grasp and the ground truth, in degrees, `[0, 180]`.
        error_degrees: f64,
        /// The detector's score.
        score: f64,
    },
    /// The part was present and was not detected.
    Missed,
    /// The part was absent.
    Absent {
        /// Score of the best detection, zero without one.
        score: f64,
    },
}

impl Outcome {
    /// Compares a detected grasp with the ground truth. `demonstration_px_per_px` converts this image's pixels.
    pub fn found(grasp: &PlanarGrasp, truth: &PlanarGrasp, score: f64, demonstration_px_per_px: f64) -> Self {
        Self::Found {
            error_px: (grasp.center() - truth.center()).norm() * demonstration_px_per_px,
            error_degrees: Angle::distance(grasp.angle, truth.angle).to_degrees(),
            score,
        }
    }

    /// Whether a found part is close enough to the ground truth for a grasp.
    pub fn is_hit(&self) -> bool {
        matches!(self, Self::Found { error_px, error_degrees, .. }
            if *error_px <= HIT_PX && *error_degrees <= HIT_DEGREES)
    }
}

/// A validation in figures.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Validation {
    /// Samples with the part.
    pub positives: usize,
    /// Number of positives found within [`HIT_PX`] and [`HIT_DEGREES`].
    pub hits: usize,
    /// Median error of all found parts, in demonstration pixels; infinite if nothing was found.
    pub median_error_px: f64,
    /// Median error of all found parts, in degrees; infinite if nothing was found.
    pub median_error_degrees: f64,
    /// Samples without the part.
    pub negatives: usize,
    /// Number of negatives with a detection whose score is at least the one that nine in ten hits reach.
    pub false_alarms: usize,
}

impl Validation {
    /// Summarises outcomes.
    pub fn from_outcomes(outcomes: &[Outcome]) -> Self {
        let (mut errors_px, mut errors_degrees) = (Vec::new(), Vec::new());
        let hit_scores = outcomes.iter().filter_map(|outcome| match outcome {
            Outcome::Found { score, .. } => Some(*score).filter(|_| outcome.is_hit()),
            _ => None,
        });
        let min_score = percentile(hit_scores, REFUSED_PERCENT).unwrap_or(NO_HIT_SCORE);
        let mut made = Self {
            positives: 0,
            hits: 0,
            median_error_px: f64::INFINITY,
            median_error_degrees: f64::INFINITY,
            negatives: 0,
            false_alarms: 0,
        };
        for outcome in outcomes {
            match *outcome {
                Outcome::Found { error_px, error_degrees, .. } => {
                    made.positives += 1;
                    made.hits += usize::from(outcome.is_hit());
                    errors_px.push(error_px);
                    errors_degrees.push(error_degrees);
                }
                Outcome::Missed => made.positives += 1,
                Outcome::Absent { score } => {
                    made.negatives += 1;
                    made.false_alarms += usize::from(score >= min_score);
                }
            }
        }
        made.median_error_px = median(errors_px).unwrap_or(f64::INFINITY);
        made.median_error_degrees = median(errors_degrees).unwrap_or(f64::INFINITY);
        made
    }

    /// Fraction of the parts found close enough for a grasp, in `[0, 1]`; zero without positives.
    pub fn hit_rate(&self) -> f64 {
        if self.positives == 0 { 0.0 } else { self.hits as f64 / self.positives as f64 }
    }

    /// One figure for comparing checkpoints, higher is better: the hit rate, minus imprecision, minus a small penalty
    /// for false alarms, which verification rejects later anyway. (A larger penalty selected networks after a third of
    /// the run, whose scores were all low.)
    pub fn merit(&self) -> f64 {
        let false_alarm_rate = self.false_alarms as f64 / self.negatives.max(1) as f64;
        let imprecision = (self.median_error_px / HIT_PX).min(1.0) + (self.median_error_degrees / HIT_DEGREES).min(1.0);
        self.hit_rate() - 0.1 * false_alarm_rate - 0.2 * imprecision
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(error_px: f64, error_degrees: f64) -> Outcome {
        Outcome::Found { error_px, error_degrees, score: 0.9 }
    }

    #[test]
    fn counts_hits_misses_and_false_alarms() {
        let outcomes = [
            found(1.0, 2.0),
            found(3.0, 179.0),
            Outcome::Missed,
            Outcome::Absent { score: 0.91 },
            Outcome::Absent { score: 0.8 },
        ];
        let validation = Validation::from_outcomes(&outcomes);
        assert_eq!((validation.positives, validation.hits), (3, 1));
        assert_eq!((validation.negatives, validation.false_alarms), (2, 1));
        assert_eq!(validation.median_error_px, 2.0);
        // Without a hit, scores are compared with `NO_HIT_SCORE`.
        let nothing_hit = Validation::from_outcomes(&[Outcome::Absent { score: 0.6 }, Outcome::Absent { score: 0.4 }]);
        assert_eq!(nothing_hit.false_alarms, 1);
    }

    #[test]
    fn errors_are_in_demonstration_pixels() {
        let truth = PlanarGrasp { x: 10.0, y: 10.0, angle: Angle::from_degrees(179.0), width: 1.0 };
        let grasp = PlanarGrasp { x: 13.0, y: 14.0, angle: Angle::from_degrees(-179.0), width: 1.0 };
        let Outcome::Found { error_px, error_degrees, .. } = Outcome::found(&grasp, &truth, 1.0, 2.0) else {
            panic!("it was found")
        };
        assert!((error_px - 10.0).abs() < 1e-12 && (error_degrees - 2.0).abs() < 1e-9);
    }

    #[test]
    fn imprecision_costs_more_than_a_false_alarm() {
        let good = [found(1.0, 1.0), Outcome::Absent { score: 0.1 }];
        let coarse = [found(8.0, 8.0), Outcome::Absent { score: 0.1 }];
        let alarmed = [found(1.0, 1.0), Outcome::Absent { score: 0.9 }];
        let merit = |outcomes: &[Outcome]| Validation::from_outcomes(outcomes).merit();
        assert!(merit(&good) > merit(&alarmed) && merit(&alarmed) > merit(&coarse));
    }

    #[test]
    fn nothing_found_is_no_number_but_infinity() {
        let validation = Validation::from_outcomes(&[Outcome::Missed]);
        assert!(validation.median_error_px.is_infinite() && validation.merit().is_finite());
    }
}
