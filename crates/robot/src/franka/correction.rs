//! Reduces a difference between the robot's reference and the trajectory to zero along a quintic.

use std::ops::Sub;

use sdg_fci::Limits;
use sdg_kinematics::{JointVector, NUM_JOINTS};

use crate::arm_state::PERIOD_SECS;

/// Duration of the shortest correction, s: ten times the longest loss of commands that the robot bridges. Longer
/// corrections double this duration up to [`MAX_DOUBLINGS`] times.
const SHORTEST_SECS: f64 = 0.2;
const MAX_DOUBLINGS: i32 = 2;
/// Largest fraction of the acceleration and jerk limits that a correction uses, unless even the longest correction
/// needs more. The trajectory itself uses at most 0.4 of the acceleration and 0.2 of the jerk limits on free motions.
const SHARE: f64 = 0.3;
/// Number of equal steps in which a correction is compared with the limits.
const NUM_SAMPLES: u32 = 20;

/// A reference, or the difference between two references. Derivatives are differences over a cycle, as the robot
/// computes them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Deviation {
    /// Positions, rad.
    pub(super) q: JointVector,
    /// Velocities, rad/s.
    pub(super) dq: JointVector,
    /// Accelerations, rad/s².
    pub(super) ddq: JointVector,
}

impl Sub for Deviation {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        Self { q: self.q - other.q, dq: self.dq - other.dq, ddq: self.ddq - other.ddq }
    }
}

/// A deviation that decreases to zero: `x(u) = (c0 + c1 u + c2 u²) (1 - u)³` with `u` from 0 to 1, at rest at its end.
#[derive(Debug, Clone, Copy)]
pub(super) struct Correction {
    coefficients: [JointVector; 3],
    duration_secs: f64,
    num_cycles: u32,
}

impl Correction {
    /// Creates the correction of a deviation: the shortest one within the limits, or the longest one if none is within
    /// them.
    pub(super) fn new(deviation: Deviation, limits: &Limits) -> Self {
        let lasting = |doublings| Self::lasting(&deviation, SHORTEST_SECS * 2_f64.powi(doublings));
        let longest = lasting(MAX_DOUBLINGS);
        (0..MAX_DOUBLINGS).map(lasting).find(|shorter| shorter.keeps_to(&deviation, limits)).unwrap_or(longest)
    }

    fn lasting(deviation: &Deviation, duration_secs: f64) -> Self {
        // A difference over the last cycle is the velocity of half a cycle ago.
        let velocity = deviation.dq + deviation.ddq * (0.5 * PERIOD_SECS);
        let (dx, ddx) = (velocity * duration_secs, deviation.ddq * (duration_secs * duration_secs));
        // The product's derivatives at 0 are those of the deviation.
        let c0 = deviation.q;
        let c1 = dx + c0 * 3.0;
        let c2 = ddx * 0.5 + c1 * 3.0 - c0 * 3.0;
        Self { coefficients: [c0, c1, c2], duration_secs, num_cycles: 0 }
    }

    /// The deviation after the next cycle; `None` once the correction has ended.
    pub(super) fn next(&mut self) -> Option<JointVector> {
        self.num_cycles += 1;
        let u = f64::from(self.num_cycles) * PERIOD_SECS / self.duration_secs;
        (u < 1.0).then(|| self.at(u))
    }

    fn at(&self, u: f64) -> JointVector {
        let [c0, c1, c2] = self.coefficients;
        (c0 + c1 * u + c2 * (u * u)) * (1.0 - u).powi(3)
    }

    /// Whether acceleration and jerk are at most [`SHARE`] of the limits. An initial acceleration above that is
    /// allowed, because it cannot be changed.
    fn keeps_to(&self, deviation: &Deviation, limits: &Limits) -> bool {
        let step = 1.0 / f64::from(NUM_SAMPLES);
        let step_secs = step * self.duration_secs;
        let mut before = deviation.ddq;
        // Second differences of samples approximate accelerations at their centre.
        (1..NUM_SAMPLES).all(|sample| {
            let u = f64::from(sample) * step;
            let bend = self.at(u + step) - self.at(u) * 2.0 + self.at(u - step);
            let acceleration = bend / (step_secs * step_secs);
            let jerk = (acceleration - before) / step_secs;
            before = acceleration;
            (0..NUM_JOINTS).all(|idx| {
                let allowed = (SHARE * limits.acceleration[idx]).max(deviation.ddq[idx].abs());
                acceleration[idx].abs() <= allowed && jerk[idx].abs() <= SHARE * limits.jerk[idx]
            })
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn joint_2(q: f64, dq: f64, ddq: f64) -> Deviation {
        let only = |value| JointVector::from([0.0, value, 0.0, 0.0, 0.0, 0.0, 0.0]);
        Deviation { q: only(q), dq: only(dq), ddq: only(ddq) }
    }

    #[test]
    fn it_begins_with_the_deviation_and_ends_at_rest_within_the_limits() {
        for (q, dq, ddq) in [(1e-6, 0.0, 0.0), (1e-3, 0.1, 3.0), (-5e-4, 0.05, -2.0), (2e-3, 0.0, 0.0)] {
            let mut correction = Correction::new(joint_2(q, dq, ddq), &Limits::PANDA);
            let mut positions = vec![q - dq * PERIOD_SECS, q];
            while let Some(offset) = correction.next() {
                positions.push(offset[1]);
            }
            positions.extend([0.0; 3]);
            let differences =
                |values: &[f64]| values.windows(2).map(|pair| (pair[1] - pair[0]) / PERIOD_SECS).collect::<Vec<f64>>();
            let accelerations = differences(&differences(&positions));
            // The previous motion is continued: the acceleration changes by less than the jerk limit allows in a cycle.
            assert!((accelerations[0] - ddq).abs() < 1.5, "{} {ddq}", accelerations[0]);
            let hardest = accelerations.iter().fold(0.0_f64, |max, value| max.max(value.abs()));
            assert!(hardest <= ddq.abs().max(0.3 * 7.5) + 1.0, "{hardest} for {q} {dq} {ddq}");
            assert!(differences(&accelerations).iter().all(|jerk| jerk.abs() <= 0.5 * 3750.0));
        }
    }

    #[test]
    fn a_small_deviation_is_taken_back_soon_and_a_large_one_later() {
        let num_cycles = |deviation| {
            let mut correction = Correction::new(deviation, &Limits::PANDA);
            std::iter::from_fn(|| correction.next()).count()
        };
        assert_eq!(num_cycles(joint_2(1e-6, 0.0, 0.0)), 199);
        assert_eq!(num_cycles(joint_2(3e-2, 0.0, 0.0)), 399);
    }
}
