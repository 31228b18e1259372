//! Limits of the robot: positions, velocities, accelerations, jerks and torques, in joint and Cartesian space.

use crate::error::KinematicsError;
use crate::joints::{JointVector, LimitViolation};

/// Limits of all joints.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct JointLimits {
    /// Smallest positions, rad.
    pub position_min: JointVector,
    /// Largest positions, rad.
    pub position_max: JointVector,
    /// Largest speeds, rad/s.
    pub velocity_max: JointVector,
    /// Largest accelerations, rad/s².
    pub acceleration_max: JointVector,
    /// Largest jerks, rad/s³.
    pub jerk_max: JointVector,
    /// Largest torques, N·m; [`JointLimits::scaled`] does not change them.
    pub torque_max: JointVector,
}

impl JointLimits {
    /// The same position ranges, with velocity, acceleration and jerk multiplied by the given factors.
    ///
    /// # Errors
    /// A factor outside (0, 1] is a [`KinematicsError::InvalidOption`].
    pub fn scaled(&self, velocity: f64, acceleration: f64, jerk: f64) -> Result<Self, KinematicsError> {
        check_factors(&[velocity, acceleration, jerk])?;
        Ok(Self {
            velocity_max: self.velocity_max * velocity,
            acceleration_max: self.acceleration_max * acceleration,
            jerk_max: self.jerk_max * jerk,
            ..self.clone()
        })
    }

    /// Distance of each joint to its nearer position limit, rad; negative outside.
    pub fn margins(&self, q: &JointVector) -> JointVector {
        (q - self.position_min).zip_map(&(self.position_max - q), f64::min)
    }

    /// The joint that is furthest outside its range, if by more than `tolerance_rad`.
    pub fn worst_violation(&self, q: &JointVector, tolerance_rad: f64) -> Option<LimitViolation> {
        let (joint_idx, margin) = self.margins(q).argmin();
        (margin < -tolerance_rad).then(|| self.violation_at(q, joint_idx))
    }

    /// The closest joint positions inside the ranges.
    pub fn clamp(&self, q: &JointVector) -> JointVector {
        q.sup(&self.position_min).inf(&self.position_max)
    }

    /// Centre of each joint's range, rad.
    pub fn middle(&self) -> JointVector {
        (self.position_min + self.position_max) * 0.5
    }

    /// Whether radians were probably given as degrees: `q` (rad), converted from degrees, violates the limits, but the
    /// numbers before the conversion, taken as radians, do not.
    pub fn are_radians_given_as_degrees(&self, q: &JointVector) -> bool {
        self.worst_violation(q, 0.0).is_some() && self.worst_violation(&q.map(f64::to_degrees), 0.0).is_none()
    }

    pub(crate) fn violation_at(&self, q: &JointVector, joint_idx: usize) -> LimitViolation {
        LimitViolation {
            joint: joint_idx + 1,
            found_rad: q[joint_idx],
            min_rad: self.position_min[joint_idx],
            max_rad: self.position_max[joint_idx],
        }
    }
}

/// Limits of the tcp's motion along a Cartesian path.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct CartesianLimits {
    /// Largest speed, m/s.
    pub velocity_m_s: f64,
    /// Largest acceleration, m/s².
    pub acceleration_m_s2: f64,
    /// Largest jerk, m/s³.
    pub jerk_m_s3: f64,
    /// Largest angular speed, rad/s.
    pub angular_velocity_rad_s: f64,
    /// Largest angular acceleration, rad/s².
    pub angular_acceleration_rad_s2: f64,
    /// Largest angular jerk, rad/s³.
    pub angular_jerk_rad_s3: f64,
}

impl CartesianLimits {
    /// The limits multiplied by the given factors, linear and angular alike.
    ///
    /// # Errors
    /// A factor outside (0, 1] is a [`KinematicsError::InvalidOption`].
    pub fn scaled(&self, velocity: f64, acceleration: f64, jerk: f64) -> Result<Self, KinematicsError> {
        check_factors(&[velocity, acceleration, jerk])?;
        Ok(Self {
            velocity_m_s: self.velocity_m_s * velocity,
            acceleration_m_s2: self.acceleration_m_s2 * acceleration,
            jerk_m_s3: self.jerk_m_s3 * jerk,
            angular_velocity_rad_s: self.angular_velocity_rad_s * velocity,
            angular_acceleration_rad_s2: self.angular_acceleration_rad_s2 * acceleration,
            angular_jerk_rad_s3: self.angular_jerk_rad_s3 * jerk,
        })
    }
}

fn check_factors(factors: &[f64]) -> Result<(), KinematicsError> {
    match factors.iter().find(|f| !(**f > 0.0 && **f <= 1.0)) {
        None => Ok(()),
        Some(found) => Err(KinematicsError::InvalidOption {
            option: "limit scaling",
            expected: "a factor in (0, 1]",
            found: *found,
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::joints::ready_pose;

    #[test]
    fn the_ready_pose_is_inside_and_margins_are_hand_checkable() {
        let limits = JointLimits::panda();
        let margins = limits.margins(&ready_pose());
        assert!((margins[0] - 2.8973).abs() < 1e-12);
        assert!((margins[3] - (3.0718 - 3.0 * std::f64::consts::FRAC_PI_4)).abs() < 1e-12);
        assert_eq!(limits.worst_violation(&ready_pose(), 0.0), None);
    }

    #[test]
    fn the_worst_joint_is_named_as_franka_counts() {
        let limits = JointLimits::panda();
        let mut q = ready_pose();
        q[3] = 0.0; // 0.0698 too high
        q[5] = -0.1175; // 0.1 too low
        let worst = limits.worst_violation(&q, 1e-9).unwrap();
        assert_eq!(worst.joint, 6);
        assert!((worst.excess_rad() - 0.1).abs() < 1e-12);
        assert_eq!(limits.worst_violation(&limits.clamp(&q), 0.0), None);
    }

    #[test]
    fn scaling_refuses_what_is_no_share() {
        for bad in [0.0, -0.5, 1.5, f64::NAN] {
            assert!(JointLimits::panda().scaled(1.0, bad, 1.0).is_err());
            assert!(CartesianLimits::panda().scaled(bad, 1.0, 1.0).is_err());
        }
        let half = JointLimits::panda().scaled(0.5, 0.25, 0.125).unwrap();
        assert_eq!(half.velocity_max[0], 1.0875);
        assert_eq!(half.acceleration_max[1], 1.875);
        assert_eq!(half.jerk_max[6], 1250.0);
    }
}
