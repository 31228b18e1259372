//! Shakes the arm around its position, to test a grasp.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use nalgebra::{Vector3, Vector6};
use sdg_kinematics::JointVector;
use sdg_robot::PERIOD_SECS;

use crate::attempt_errors::Shake;
use crate::controller::ArmReference;
use crate::error::Result;
use crate::workcell::Workcell;

/// Rise and fall time of the swing, in seconds.
const RAMP_SECS: f64 = 0.2;

/// Largest fraction of the arm's velocity and acceleration limits that a shake uses.
const SHARE_OF_LIMITS: f64 = 0.9;

/// Damping that keeps the inverse of the Jacobian finite near singular postures, in square metres.
const DAMPING: f64 = 1e-6;

impl Shake {
    /// Position, velocity and acceleration of the hand along its line at a time, for an amplitude of one.
    fn at(&self, time_secs: f64) -> [f64; 3] {
        let omega = TAU * self.frequency_hz;
        let (sin, cos) = (omega * time_secs).sin_cos();
        // The amplitude rises along a squared sine from rest, and falls in the same way at the end.
        let (since, sign) = match time_secs < 0.5 * self.duration_secs {
            true => (time_secs, 1.0),
            false => (self.duration_secs - time_secs, -1.0),
        };
        let u = (since / RAMP_SECS).clamp(0.0, 1.0);
        let is_ramp = f64::from(u8::from(u > 0.0 && u < 1.0));
        let w = (FRAC_PI_2 * u).sin().powi(2);
        let dw = is_ramp * sign * FRAC_PI_2 / RAMP_SECS * (PI * u).sin();
        let ddw = is_ramp * 0.5 * (PI / RAMP_SECS).powi(2) * (PI * u).cos();
        [w * sin, dw * sin + w * omega * cos, ddw * sin + 2.0 * dw * omega * cos - w * omega * omega * sin]
    }
}

impl Workcell {
    /// Swings the hand without rotating it, and ends at the start; returns the amplitude that the arm's limits allowed,
    /// in metres.
    ///
    /// # Errors
    /// As for [`crate::Data::step`], or a renderer's error while recording.
    pub(crate) fn shake(&mut self, shake: &Shake) -> Result<f64> {
        let start = self.commanded();
        let along = Vector3::new(shake.direction_rad.cos(), shake.direction_rad.sin(), 0.0);
        // Joint motion per metre along the line, with a constant orientation of the hand. The Jacobian hardly changes
        // over some centimetres.
        let jacobian = self.panda.jacobian(&start);
        let damped = jacobian * jacobian.transpose() + nalgebra::Matrix6::identity() * DAMPING;
        let twist = Vector6::new(along.x, along.y, along.z, 0.0, 0.0, 0.0);
        let solved = damped.cholesky().map_or_else(Vector6::zeros, |factors| factors.solve(&twist));
        let q_per_m: JointVector = jacobian.transpose() * solved;

        let limits = &self.panda.limits;
        let num_periods = (shake.duration_secs / PERIOD_SECS).round() as usize;
        let times = (1..=num_periods).map(|period| period as f64 * PERIOD_SECS);
        let amplitude_m = times.clone().fold(shake.amplitude_m, |amplitude_m, time_secs| {
            let [_, velocity, acceleration] = shake.at(time_secs);
            let most = |limits: &JointVector, rate: f64| {
                let needed = (0..7).map(|joint| (q_per_m[joint] * rate / limits[joint]).abs()).fold(1e-9, f64::max);
                SHARE_OF_LIMITS / needed
            };
            amplitude_m.min(most(&limits.velocity_max, velocity)).min(most(&limits.acceleration_max, acceleration))
        });
        for time_secs in times {
            let [position, velocity, acceleration] = shake.at(time_secs).map(|value| q_per_m * (amplitude_m * value));
            self.set_reference(ArmReference { position: start + position, velocity, acceleration });
            self.tick()?;
        }
        self.set_reference(ArmReference::at_rest(start));
        Ok(amplitude_m)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SHAKE: Shake = Shake { amplitude_m: 0.025, frequency_hz: 2.5, duration_secs: 1.0, direction_rad: 0.0 };

    #[test]
    fn rates_are_the_derivatives_of_the_position() {
        const STEP: f64 = 1e-5;
        for time in [0.05, 0.1, 0.31, 0.55, 0.85, 0.95] {
            let [before, here, after] = [time - STEP, time, time + STEP].map(|time| SHAKE.at(time));
            // With this step, the errors of central differences are far below the tolerances.
            assert!(((after[0] - before[0]) / (2.0 * STEP) - here[1]).abs() < 1e-4, "{time}");
            assert!(((after[1] - before[1]) / (2.0 * STEP) - here[2]).abs() < 1e-2, "{time}");
        }
        for end in [0.0, 1.0] {
            let [position, velocity, _] = SHAKE.at(end);
            assert!(position.abs() < 1e-9 && velocity.abs() < 1e-9);
        }
    }
}
