//! Angles as classes on a circle, and the conversion of class probabilities back to angles, to a fraction of a class.
//!
//! There are K classes; class k is centred on k · 360° / K (divided by the symmetry, see below). A *position* is a
//! point on the circle of classes in [0, K), with fractions.
//!
//! A part that looks the same after a rotation by 360° / n has n equivalent angles, and a network trained on the
//! recorded one would learn their mean. So the angle is **folded**: n·θ replaces θ, the circle of classes is one n-th
//! of a full rotation of the part, and the loss does not depend on rotations that no picture shows.

use std::f64::consts::TAU;

use sdg_geometry::Angle;
use serde::{Deserialize, Serialize};

/// The circle of angle classes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct AngleClasses {
    /// Number of classes, K.
    pub num_classes: usize,
    /// n: the number of rotations, including the full one, after which the part looks the same; 1 for most parts.
    pub symmetry: usize,
}

/// The target distribution for a true angle.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Labels {
    /// The whole probability in the nearest class, as in the paper: an error of one degree costs as much as one of 180
    /// degrees.
    Hard,
    /// A bell around the exact angle, cyclic like the classes.
    VonMises {
        /// Standard deviation, in classes (degrees, for 360 classes and no symmetry).
        sigma_classes: f64,
    },
}

/// An angle from the network's output.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AngleReading {
    /// The angle, in (-π, π] / n.
    pub angle: Angle,
    /// Probability of the angles near this one, in [0, 1].
    pub confidence: f64,
}

impl AngleClasses {
    /// The position of an angle on the circle of classes, in [0, K).
    pub fn position(&self, angle: Angle) -> f64 {
        let turns = angle.radians() * self.symmetry as f64 / TAU;
        let position = turns.rem_euclid(1.0) * self.num_classes as f64;
        // A very small negative angle rounds up to a full rotation.
        if position < self.num_classes as f64 { position } else { 0.0 }
    }

    /// The angle at a position, in (-π, π] / n.
    pub fn angle(&self, position: f64) -> Angle {
        let folded = Angle::from_radians(position * TAU / self.num_classes as f64);
        Angle::from_radians(folded.radians() / self.symmetry as f64)
    }

    /// The nearest class.
    pub fn class_of(&self, angle: Angle) -> usize {
        self.position(angle).round() as usize % self.num_classes
    }

    /// The smallest visible rotation between two angles of the part, in radians, [0, π / n].
    pub fn distance(&self, one: Angle, other: Angle) -> f64 {
        let n = self.symmetry as f64;
        Angle::from_radians((one - other).radians() * n).radians().abs() / n
    }

    /// The distribution over the classes for a true angle; its sum is one.
    pub fn targets(&self, angle: Angle, labels: Labels) -> Vec<f32> {
        match labels {
            Labels::Hard => {
                let mut one_hot = vec![0.0; self.num_classes];
                one_hot[self.class_of(angle)] = 1.0;
                one_hot
            }
            Labels::VonMises { sigma_classes } => {
                let bell = self.bell(self.position(angle), sigma_classes);
                let sum: f64 = bell.iter().sum();
                bell.iter().map(|value| (value / sum) as f32).collect()
            }
        }
    }

    /// A von Mises density around a position, one at its peak.
    fn bell(&self, center: f64, sigma_classes: f64) -> Vec<f64> {
        let radians_per_class = TAU / self.num_classes as f64;
        // For narrow bells 1 / σ² is the concentration κ.
        let concentration = 1.0 / (sigma_classes * radians_per_class).powi(2);
        (0..self.num_classes)
            .map(|class| (concentration * (((class as f64 - center) * radians_per_class).cos() - 1.0)).exp())
            .collect()
    }

    /// Computes the angle from probabilities `[K]`, to a fraction of a class: the circular mean within `window`
    /// classes on both sides of the peak.
    ///
    /// The peak is that of the probabilities smoothed over half a window, so a single high class among empty ones does
    /// not win over a broad maximum. Classes beyond the window are confusions, often at 180°, and must not enter the
    /// mean.
    pub fn read(&self, probabilities: &[f64], window: usize) -> AngleReading {
        let k = self.num_classes;
        assert_eq!(probabilities.len(), k, "one probability per class");
        let at = |class: usize, offset: isize| probabilities[(class as isize + offset).rem_euclid(k as isize) as usize];
        let reach = window.min((k - 1) / 2) as isize;
        let smooth = reach / 2;
        let smoothed =
            |class: usize| -> f64 { (-smooth..=smooth).map(|o| (smooth + 1 - o.abs()) as f64 * at(class, o)).sum() };
        let peak = (0..k)
            .map(|class| (class, smoothed(class)))
            .fold((0, f64::MIN), |best, candidate| if candidate.1 > best.1 { candidate } else { best });
        let radians_per_class = TAU / k as f64;
        let (mut x, mut y, mut mass) = (0.0, 0.0, 0.0);
        for offset in -reach..=reach {
            let (weight, turn) = (at(peak.0, offset), offset as f64 * radians_per_class);
            x += weight * turn.cos();
            y += weight * turn.sin();
            mass += weight;
        }
        let position = peak.0 as f64 + y.atan2(x) / radians_per_class;
        AngleReading { angle: self.angle(position), confidence: mass.min(1.0) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const DEGREES: AngleClasses = AngleClasses { num_classes: 360, symmetry: 1 };
    const SOFT: Labels = Labels::VonMises { sigma_classes: 4.0 };

    /// Error by the rounding of f32 targets, and by the tails that the window truncates.
    const READOUT_TOLERANCE_DEGREES: f64 = 1e-3;

    #[test]
    fn class_359_is_followed_by_class_0() {
        assert_eq!(DEGREES.class_of(Angle::from_degrees(359.4)), 359);
        assert_eq!(DEGREES.class_of(Angle::from_degrees(359.6)), 0);
        assert_eq!(DEGREES.class_of(Angle::from_degrees(-0.4)), 0);
        assert_eq!(DEGREES.position(Angle::from_degrees(-1e-14)), 0.0);
        assert!((DEGREES.angle(359.5).degrees() + 0.5).abs() < 1e-9);
    }

    #[test]
    fn soft_labels_wrap_and_are_symmetric() {
        let targets = DEGREES.targets(Angle::ZERO, SOFT);
        assert!((targets.iter().sum::<f32>() - 1.0).abs() < 1e-5);
        for offset in 1..180 {
            assert!((targets[offset] - targets[360 - offset]).abs() < 1e-9, "{offset}");
        }
        // Halfway between classes 359 and 0, both have the same probability.
        let between = DEGREES.targets(Angle::from_degrees(-0.5), SOFT);
        assert!((between[359] - between[0]).abs() < 1e-7 && between[0] > between[1]);
        // One standard deviation from the peak: e^-½.
        assert!((targets[4] / targets[0] - (-0.5f32).exp()).abs() < 1e-3);
    }

    #[test]
    fn hard_labels_are_one_class() {
        let targets = DEGREES.targets(Angle::from_degrees(359.7), Labels::Hard);
        assert_eq!(targets[0], 1.0);
        assert_eq!(targets.iter().sum::<f32>(), 1.0);
    }

    #[test]
    fn a_hill_wins_over_a_spike_and_half_a_turn_does_not_pull() {
        let mut probabilities = vec![0.0; 360];
        for (offset, share) in [0.1, 0.15, 0.2, 0.15, 0.1].into_iter().enumerate() {
            probabilities[98 + offset] = share;
        }
        probabilities[280] = 0.3;
        let reading = DEGREES.read(&probabilities, 10);
        assert!((reading.angle.degrees() - 100.0).abs() < 1e-9, "{reading:?}");
        assert!((reading.confidence - 0.7).abs() < 1e-9);
    }

    #[test]
    fn symmetric_parts_are_folded() {
        let quarter = AngleClasses { num_classes: 360, symmetry: 4 };
        let [one, same] = [17.0, 107.0].map(Angle::from_degrees);
        assert!((quarter.position(one) - quarter.position(same)).abs() < 1e-9);
        assert!((quarter.position(one) - 68.0).abs() < 1e-9);
        assert!((quarter.angle(68.0).degrees() - 17.0).abs() < 1e-9);
        assert!(quarter.distance(one, same) < 1e-9);
        let apart = quarter.distance(Angle::from_degrees(44.0), Angle::from_degrees(-44.0));
        assert!((apart.to_degrees() - 2.0).abs() < 1e-9);
    }

    proptest! {
        #[test]
        fn what_is_written_is_read_to_a_fraction_of_a_degree(degrees in -180.0f64..180.0, symmetry in 1usize..5) {
            let classes = AngleClasses { num_classes: 360, symmetry };
            let angle = Angle::from_degrees(degrees);
            let probabilities: Vec<f64> = classes.targets(angle, SOFT).into_iter().map(f64::from).collect();
            let reading = classes.read(&probabilities, 20);
            prop_assert!(classes.distance(reading.angle, angle).to_degrees() < READOUT_TOLERANCE_DEGREES);
            prop_assert!(reading.confidence > 0.999);
        }

        #[test]
        fn positions_round_trip(position in 0.0f64..360.0, symmetry in 1usize..7) {
            let classes = AngleClasses { num_classes: 360, symmetry };
            let back = classes.position(classes.angle(position));
            let apart = (back - position).abs();
            prop_assert!(apart.min(360.0 - apart) < 1e-9);
        }
    }
}
