//! Joint references: the next reference from a command, and whether the robot would accept it.

use super::plant::JointVector;
use crate::limits::Limits;
use crate::wire::MotionGeneratorMode;
use crate::wire::robot_error::{RobotError, RobotErrors};

/// One cycle in seconds.
pub const PERIOD_SECS: f64 = 1e-3;
/// Fraction of the acceleration limits for braking: the controllers overshoot a sudden change of the acceleration by up
/// to a quarter, so that the arm just stays within its limits.
const BRAKING: f64 = 0.8;
/// Factor of the limits: rounding differences of doubles are not violations.
pub(super) const ROUNDING: f64 = 1.0 + 1e-6;

/// The controller's reference of the joints: `q_d`, `dq_d`, `ddq_d`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointReference {
    /// Positions, rad.
    pub q: JointVector,
    /// Velocities, rad/s.
    pub dq: JointVector,
    /// Accelerations, rad/s².
    pub ddq: JointVector,
}

impl JointReference {
    /// A reference at rest at a position.
    pub fn at_rest(q: JointVector) -> Self {
        Self { q, dq: JointVector::zeros(), ddq: JointVector::zeros() }
    }

    /// The reference after a commanded position.
    pub fn after_position(&self, q: JointVector) -> Self {
        let dq = (q - self.q) / PERIOD_SECS;
        Self { q, dq, ddq: (dq - self.dq) / PERIOD_SECS }
    }

    /// The reference after a commanded velocity.
    pub fn after_velocity(&self, dq: JointVector) -> Self {
        Self { q: self.q + dq * PERIOD_SECS, dq, ddq: (dq - self.dq) / PERIOD_SECS }
    }

    /// The reference after a cycle without a command: constant acceleration.
    pub fn extrapolated(&self) -> Self {
        let dq = self.dq + self.ddq * PERIOD_SECS;
        Self { q: self.q + dq * PERIOD_SECS, dq, ddq: self.ddq }
    }

    /// One cycle of braking with `BRAKING` of the acceleration limits.
    pub fn braked(&self, limits: &Limits) -> Self {
        let dq = JointVector::from_fn(|joint, _| {
            let step = limits.acceleration[joint] * BRAKING * PERIOD_SECS;
            self.dq[joint] - self.dq[joint].clamp(-step, step)
        });
        self.after_velocity(dq)
    }

    /// This motion with the acceleration that brakes it, or its position at rest if it ends within a cycle. The
    /// controller has no difference to correct, whereas a reference that moved on would press on an obstacle.
    pub fn yielding(&self, limits: &Limits) -> Self {
        let braked = self.braked(limits);
        if braked.is_at_rest() { Self::at_rest(self.q) } else { Self { ddq: braked.ddq, ..*self } }
    }

    /// Whether the reference is at rest.
    pub fn is_at_rest(&self) -> bool {
        self.dq.amax() == 0.0
    }

    /// The errors for which the robot would stop between `previous` and this reference.
    ///
    /// The errors have the interface's names: too large an acceleration is a discontinuity of the velocity if positions
    /// or poses are commanded, and of the acceleration if velocities or twists are commanded.
    pub fn violations(&self, previous: &Self, limits: &Limits, generator: MotionGeneratorMode) -> RobotErrors {
        let jerk = (self.ddq - previous.ddq) / PERIOD_SECS;
        let exceeds = |values: &JointVector, limits: &[f64; 7]| {
            values.iter().zip(limits).any(|(value, limit)| value.abs() > limit * ROUNDING)
        };
        let is_too_fast = (0..7).any(|joint| {
            let [min, max] = limits.velocity_range(joint, self.q[joint]);
            !(min * ROUNDING..=max * ROUNDING).contains(&self.dq[joint])
        });
        let out_of_range = (0..7).any(|joint| !(limits.q_min[joint]..=limits.q_max[joint]).contains(&self.q[joint]));
        let [position, velocity, velocity_step, acceleration_step] = match generator {
            MotionGeneratorMode::CartesianPosition | MotionGeneratorMode::CartesianVelocity => [
                RobotError::CartesianMotionGeneratorJointPositionLimitsViolation,
                RobotError::CartesianMotionGeneratorJointVelocityLimitsViolation,
                RobotError::CartesianMotionGeneratorJointVelocityDiscontinuity,
                RobotError::CartesianMotionGeneratorJointAccelerationDiscontinuity,
            ],
            _ => [
                RobotError::JointMotionGeneratorPositionLimitsViolation,
                RobotError::JointMotionGeneratorVelocityLimitsViolation,
                RobotError::JointMotionGeneratorVelocityDiscontinuity,
                RobotError::JointMotionGeneratorAccelerationDiscontinuity,
            ],
        };
        let is_velocity =
            matches!(generator, MotionGeneratorMode::JointVelocity | MotionGeneratorMode::CartesianVelocity);
        let violated = [
            (position, out_of_range),
            (velocity, is_too_fast),
            (if is_velocity { acceleration_step } else { velocity_step }, exceeds(&self.ddq, &limits.acceleration)),
            (acceleration_step, exceeds(&jerk, &limits.jerk)),
        ];
        violated.into_iter().filter_map(|(name, violated)| violated.then_some(name)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn with_joint_1(values: [f64; 3]) -> JointReference {
        let mut reference = JointReference::at_rest(JointVector::from([0.0, 0.0, 0.0, -1.5, 0.0, 1.5, 0.0]));
        [reference.q[0], reference.dq[0], reference.ddq[0]] = values;
        reference
    }

    fn names(previous: &JointReference, next: &JointReference) -> Vec<&'static str> {
        let errors = next.violations(previous, &Limits::PANDA, MotionGeneratorMode::JointPosition);
        errors.iter().map(RobotError::name).collect()
    }

    #[test]
    fn each_limit_is_told_just_outside_and_not_just_inside() {
        let rest = with_joint_1([0.0; 3]);
        // 7500 rad/s³ for a millisecond from rest: 7.5 rad/s², which give 7.5e-3 rad/s in the same cycle.
        for (share, expected) in [(0.999, vec![]), (1.001, vec!["joint_motion_generator_acceleration_discontinuity"])] {
            assert_eq!(names(&rest, &rest.after_velocity(with_joint_1([0.0, 7.5e-3 * share, 0.0]).dq)), expected);
        }
        // From 14.995 rad/s², the limit of 15 can be exceeded within the jerk limit.
        let accelerating = with_joint_1([0.0, 1.0, 14.995]);
        for (acceleration, expected) in
            [(14.999, vec![]), (15.001, vec!["joint_motion_generator_velocity_discontinuity"])]
        {
            let dq = with_joint_1([0.0, 1.0 + acceleration * 1e-3, 0.0]).dq;
            assert_eq!(names(&accelerating, &accelerating.after_velocity(dq)), expected);
        }
        let fast = with_joint_1([0.0, 2.1745, 0.0]);
        for (velocity, expected) in
            [(2.1749, vec![]), (2.1751, vec!["joint_motion_generator_velocity_limits_violation"])]
        {
            assert_eq!(names(&fast, &fast.after_velocity(with_joint_1([0.0, velocity, 0.0]).dq)), expected);
        }
        let near_the_end = with_joint_1([2.89725, 0.05, 0.0]);
        for (q, expected) in [(2.897299, vec![]), (2.897301, vec!["joint_motion_generator_position_limits_violation"])]
        {
            assert_eq!(names(&near_the_end, &near_the_end.after_position(with_joint_1([q, 0.0, 0.0]).q)), expected);
        }
    }

    #[test]
    fn a_lost_command_keeps_the_acceleration() {
        let next = with_joint_1([0.5, 1.0, 2.0]).extrapolated();
        assert!((next.dq[0] - 1.002).abs() < 1e-12);
        assert!((next.q[0] - 0.501002).abs() < 1e-12);
        assert_eq!(next.ddq[0], 2.0);
    }

    #[test]
    fn braking_ends_at_rest_within_the_limits() {
        let mut reference = with_joint_1([0.0, 1.5, 0.0]);
        let mut num_cycles = 0;
        while !reference.is_at_rest() {
            reference = reference.braked(&Limits::PANDA);
            assert!(reference.ddq[0].abs() <= 15.0 + 1e-9);
            num_cycles += 1;
        }
        // 1.5 rad/s at 12 rad/s².
        assert!((125..=126).contains(&num_cycles), "{num_cycles}");
    }
}
