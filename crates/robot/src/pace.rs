//! Speed of the sequence, as fractions of an arm's limits.

use sdg_kinematics::{ArmGeometry, CartesianLimits, JointLimits};

use crate::error::{Result, RobotError};

/// Fractions of the arm's velocity, acceleration and jerk limits.
type Shares = [f64; 3];

/// Largest allowed fraction of the joints' velocity limits: the fraction in rehearsals. Higher speeds were never tried.
pub const MAX_SPEED: f64 = 0.6;
/// Default speed of a real arm, as a fraction of the joints' velocity limits.
pub const DEFAULT_SPEED: f64 = 0.1;

/// The speed of each kind of motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pace {
    /// Free motions, as fractions of the joints' limits.
    free: Shares,
    /// Free motions with the part, as fractions of the joints' limits: slow acceleration keeps the part from sliding
    /// between the fingers.
    carry: Shares,
    /// The final descent, as fractions of the tcp's limits.
    approach: Shares,
    /// The ascent with the part, as fractions of the tcp's limits.
    lift: Shares,
}

impl Pace {
    /// Pace of rehearsals.
    pub const REHEARSED: Self = Self {
        free: [MAX_SPEED, 0.4, 0.2],
        carry: [0.3, 0.1, 0.05],
        approach: [0.18, 0.10, 0.05],
        lift: [0.25, 0.10, 0.05],
    };

    /// Free motions at a fraction of the joints' velocity limits; all other motions scale in proportion.
    ///
    /// # Errors
    /// [`RobotError::Configuration`] for a fraction that is not above 0 and at most [`MAX_SPEED`].
    pub fn at_speed(speed: f64) -> Result<Self> {
        if !(speed > 0.0 && speed <= MAX_SPEED) {
            return Err(RobotError::Configuration {
                what: "speed".into(),
                expected: format!("a fraction of the arm's velocity limits above 0 and at most {MAX_SPEED}"),
                found: speed.to_string(),
            });
        }
        let scaled = |shares: Shares| shares.map(|share| share * (speed / MAX_SPEED));
        let Self { free, carry, approach, lift } = Self::REHEARSED;
        Ok(Self { free: scaled(free), carry: scaled(carry), approach: scaled(approach), lift: scaled(lift) })
    }

    /// Joint limits of free motions.
    pub fn free_limits(&self, arm: &ArmGeometry) -> JointLimits {
        of_joints(arm, self.free)
    }

    /// Joint limits of free motions with the part.
    pub fn carry_limits(&self, arm: &ArmGeometry) -> JointLimits {
        of_joints(arm, self.carry)
    }

    /// Limits of the tcp on the approach.
    pub fn approach_limits(&self, arm: &ArmGeometry) -> CartesianLimits {
        scaled(arm, self.approach)
    }

    /// Limits of the tcp while lifting.
    pub fn lift_limits(&self, arm: &ArmGeometry) -> CartesianLimits {
        scaled(arm, self.lift)
    }
}

fn of_joints(arm: &ArmGeometry, [velocity, acceleration, jerk]: Shares) -> JointLimits {
    arm.limits.scaled(velocity, acceleration, jerk).expect("shares are in (0, 1]")
}

fn scaled(arm: &ArmGeometry, [velocity, acceleration, jerk]: Shares) -> CartesianLimits {
    arm.cartesian_limits.scaled(velocity, acceleration, jerk).expect("shares are in (0, 1]")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tenth_is_a_tenth_of_frankas_velocity() {
        let pace = Pace::at_speed(DEFAULT_SPEED).unwrap();
        assert!((pace.free_limits(&ArmGeometry::panda()).velocity_max[0] - 0.2175).abs() < 1e-12);
        // The approach has 0.18 of 1.7 m/s at speed 0.6; at 0.1 it has a sixth of that.
        assert!((pace.approach_limits(&ArmGeometry::panda()).velocity_m_s - 0.051).abs() < 1e-12);
        assert_eq!(Pace::at_speed(MAX_SPEED).unwrap(), Pace::REHEARSED);
        for bad in [0.0, -0.1, 0.61, f64::NAN] {
            let message = Pace::at_speed(bad).unwrap_err().to_string();
            assert!(message.contains("above 0 and at most 0.6"), "{message}");
        }
    }
}
