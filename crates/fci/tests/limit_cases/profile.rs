//! Velocities, one per millisecond, that bring a signal to a limit and back to rest.

use std::f64::consts::PI;

/// One cycle.
pub const PERIOD_SECS: f64 = 1e-3;

/// Velocities of a motion; 0 after its end.
#[derive(Debug, Clone, PartialEq)]
pub struct Profile(Vec<f64>);

impl Profile {
    /// Increases to a velocity along a cosine of `ramp_ms`, then decreases to zero.
    pub fn velocity(peak: f64, ramp_ms: u32) -> Self {
        let shape = |ms: u32| 0.5 * peak * (1.0 - (PI * f64::from(ms) / f64::from(ramp_ms)).cos());
        let up = (0..=ramp_ms).map(shape);
        let down = (0..ramp_ms).rev().map(shape);
        Self(up.chain([peak; 3]).chain(down).collect())
    }

    /// As [`Profile::velocity`] to 0.8 of the peak, then briefly to the peak at a constant acceleration, so that the
    /// overshoot of the arm does not exceed the limit.
    pub fn velocity_burst(peak: f64, ramp_ms: u32, acceleration: f64) -> Self {
        let base = 0.8 * peak;
        let num_steps = ((peak - base) / (acceleration * PERIOD_SECS)).ceil();
        let up = (1..=num_steps as u32).map(move |step| base + (peak - base) * f64::from(step) / num_steps);
        let burst: Vec<f64> = up.clone().chain([peak; 2]).chain(up.rev()).collect();
        let slow = Self::velocity(base, ramp_ms).0;
        let (rising, falling) = slow.split_at(ramp_ms as usize + 1);
        Self([rising, &burst, falling].concat())
    }

    /// Increases to an acceleration in ten steps, holds it for a few cycles, and reverses the sequence to return to
    /// rest.
    pub fn acceleration(peak: f64) -> Self {
        let up = (1..=10).map(|step| peak * f64::from(step) / 10.0);
        let pulse: Vec<f64> = up.clone().chain([peak; 3]).chain(up.rev()).collect();
        let back = pulse.clone().into_iter().map(|value| -value);
        Self::from_accelerations(pulse.into_iter().chain(back))
    }

    /// Changes the acceleration by one step of the jerk `peak`, and returns to rest by further steps.
    pub fn jerk(peak: f64) -> Self {
        let step = peak * PERIOD_SECS;
        Self::from_accelerations([step, 0.0, -step, 0.0].into_iter())
    }

    /// Moves smoothly by a distance in `duration_ms`.
    pub fn distance(distance: f64, duration_ms: u32) -> Self {
        // One ramp up and one ramp down.
        let ramp_ms = duration_ms / 2;
        let shape = Self::velocity(1.0, ramp_ms);
        let length = shape.offset(u64::MAX);
        Self(shape.0.iter().map(|velocity| velocity * distance / length).collect())
    }

    /// Stores values that need no conversion, such as torques.
    pub fn of(values: impl Iterator<Item = f64>) -> Self {
        Self(values.collect())
    }

    fn from_accelerations(accelerations: impl Iterator<Item = f64>) -> Self {
        let mut velocity = 0.0;
        Self(
            accelerations
                .map(|acceleration| {
                    velocity += acceleration * PERIOD_SECS;
                    velocity
                })
                .collect(),
        )
    }

    /// The velocity in the `ms`th cycle.
    pub fn value(&self, ms: u64) -> f64 {
        usize::try_from(ms).ok().and_then(|index| self.0.get(index)).copied().unwrap_or(0.0)
    }

    /// The distance up to and including the `ms`th cycle.
    pub fn offset(&self, ms: u64) -> f64 {
        let num = usize::try_from(ms).map_or(self.0.len(), |index| self.0.len().min(index.saturating_add(1)));
        self.0[..num].iter().sum::<f64>() * PERIOD_SECS
    }

    /// Whether the motion is over.
    pub fn is_over(&self, ms: u64) -> bool {
        ms as usize >= self.0.len() + 5
    }
}
