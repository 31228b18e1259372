//! Errors of a workcell: a wrong camera pose, worn pads, a shaken hand, faults of the arm, joint friction.

use std::f64::consts::TAU;

use nalgebra::{Isometry3, Translation3, Unit, UnitQuaternion, Vector3};
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

/// Error of the assumed camera position, in metres.
const HAND_EYE_SHIFT_M: f64 = 0.002;
/// Error of the assumed camera orientation, in degrees.
const HAND_EYE_TURN_DEG: f64 = 0.5;

/// Sliding friction of worn or dusty pads.
const PAD_FRICTIONS: std::ops::Range<f64> = 0.6..0.8;

/// Amplitude of the hand's swing, in metres.
const SHAKE_AMPLITUDES_M: std::ops::Range<f64> = 0.020..0.030;
/// Frequency of the swing, in Hz.
const SHAKE_FREQUENCIES_HZ: std::ops::Range<f64> = 2.0..3.0;
/// Duration of the swing, in seconds.
const SHAKE_SECS: f64 = 1.0;

/// A hand that swings along a horizontal line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shake {
    /// Amplitude, in metres; reduced if the arm's limits require it.
    pub amplitude_m: f64,
    /// Frequency, Hz.
    pub frequency_hz: f64,
    /// Duration, s.
    pub duration_secs: f64,
    /// Direction of the line in the base frame, in radians about z from x.
    pub direction_rad: f64,
}

/// A fault of the arm or its hand.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ArmFaultKind {
    /// A joint's position is reported as NaN.
    NotANumber,
    /// A joint's position is reported with an error of a radian.
    Jump,
    /// The arm stops itself, as after a contact.
    Reflex,
    /// The hand no longer follows commands.
    HandStuck,
}

/// A fault of the arm from a given time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ArmFault {
    /// Start of the fault, in seconds of simulated time.
    pub at_secs: f64,
    /// Kind of the fault.
    pub kind: ArmFaultKind,
}

/// Errors of a workcell; none by default.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct AttemptErrors {
    /// The error of the camera pose given to perception, in the camera's own frame.
    pub camera_from_assumed: Option<Isometry3<f64>>,
    /// Sliding friction of the pads. The pads then have no priority, so that MuJoCo uses the larger friction of pad and
    /// part.
    pub pad_friction: Option<f64>,
    /// The arm's motion between lifting and holding.
    pub shake: Option<Shake>,
    /// The arm's fault.
    pub arm_fault: Option<ArmFault>,
    /// Dry friction in every joint while the arm is driven by torques, N·m. Under position control, the joints have no
    /// dry friction.
    pub joint_friction_nm: f64,
}

impl AttemptErrors {
    /// A hand-eye calibration with an error of 2 mm and 0.5 degrees, in directions drawn from the seed.
    pub fn hand_eye(seed: u64) -> Self {
        let rng = &mut Pcg64Mcg::seed_from_u64(seed ^ 0x4841_4e44_5f45_5945);
        let shift = direction(rng).into_inner() * HAND_EYE_SHIFT_M;
        let turn = UnitQuaternion::from_axis_angle(&direction(rng), HAND_EYE_TURN_DEG.to_radians());
        Self { camera_from_assumed: Some(Isometry3::from_parts(Translation3::from(shift), turn)), ..Self::default() }
    }

    /// Pads with a friction of 0.6 to 0.8, drawn from the seed, without priority.
    pub fn friction(seed: u64) -> Self {
        let rng = &mut Pcg64Mcg::seed_from_u64(seed ^ 0x4652_4943_5449_4f4e);
        Self { pad_friction: Some(rng.random_range(PAD_FRICTIONS)), ..Self::default() }
    }

    /// A hand that is shaken for a second after lifting, by 20 to 30 mm to each side, at 2 to 3 Hz.
    pub fn shake(seed: u64) -> Self {
        let rng = &mut Pcg64Mcg::seed_from_u64(seed ^ 0x5348_414b_4531_3233);
        let shake = Shake {
            amplitude_m: rng.random_range(SHAKE_AMPLITUDES_M),
            frequency_hz: rng.random_range(SHAKE_FREQUENCIES_HZ),
            duration_secs: SHAKE_SECS,
            direction_rad: rng.random_range(0.0..TAU),
        };
        Self { shake: Some(shake), ..Self::default() }
    }
}

/// A uniformly distributed direction.
fn direction(rng: &mut Pcg64Mcg) -> Unit<Vector3<f64>> {
    let (z, around) = (rng.random_range(-1.0..1.0f64), rng.random_range(0.0..TAU));
    let across = (1.0 - z * z).sqrt();
    Unit::new_normalize(Vector3::new(across * around.cos(), across * around.sin(), z))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_have_their_size_in_every_direction() {
        let mut sum = Vector3::zeros();
        for seed in 0..200 {
            let error = AttemptErrors::hand_eye(seed).camera_from_assumed.unwrap();
            assert!((error.translation.vector.norm() - 0.002).abs() < 1e-12);
            assert!((error.rotation.angle().to_degrees() - 0.5).abs() < 1e-9);
            sum += error.translation.vector;
            let friction = AttemptErrors::friction(seed).pad_friction.unwrap();
            assert!((0.6..0.8).contains(&friction), "{friction}");
        }
        // The mean of 200 random shifts of 2 mm has a length of about 2 mm / sqrt(200).
        assert!((sum / 200.0).norm() < 3.0 * 0.002 / 200f64.sqrt(), "{sum}");
        assert_eq!(AttemptErrors::shake(3), AttemptErrors::shake(3));
        assert_ne!(AttemptErrors::shake(3), AttemptErrors::shake(4));
    }
}
