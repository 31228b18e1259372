//! Compares a robot's measurements with its limits.

use super::frames::shifted;
use super::plant::{Observation, Plant};
use super::robot::RobotCore;
use crate::wire::robot_error::RobotError;

/// Largest excess of measured velocities over the limit of commanded ones, rad/s or m/s, before the robot stops.
const MEASURED_VELOCITY_MARGIN: f64 = 0.1;
/// Largest excess of measured positions over the range of commanded ones, rad.
const MEASURED_POSITION_MARGIN: f64 = 0.01;
impl RobotCore {
    /// Estimates contacts and compares measurements with their limits.
    pub(super) fn monitor(&mut self, plant: &dyn Plant) {
        let (flange, flange_jacobian) = plant.flange(&self.observation.q);
        let flange_from_ee = self.settings.flange_from_ee();
        let flange_from_stiffness = flange_from_ee * self.settings.ee_from_stiffness;
        // The load's weight is known; any other force is a contact.
        let external = self.observation.contact_torque + self.load_torque(&flange, &flange_jacobian);
        self.contacts.update(
            &external,
            &shifted(&flange_jacobian, &flange, &flange_from_stiffness),
            &(flange * flange_from_stiffness),
            &self.references.joints.ddq,
            &self.settings.collision,
        );
        if self.motion.is_none() {
            return;
        }
        let Observation { q, dq, self_collision, .. } = &self.observation;
        let mut errors = self.contacts.reflexes();
        if (0..7).any(|joint| dq[joint].abs() > self.limits.velocity[joint] + MEASURED_VELOCITY_MARGIN) {
            errors.insert(RobotError::JointVelocityViolation);
        }
        let is_out_of_range = |joint: usize| {
            q[joint] < self.limits.q_min[joint] - MEASURED_POSITION_MARGIN
                || q[joint] > self.limits.q_max[joint] + MEASURED_POSITION_MARGIN
        };
        if (0..7).any(is_out_of_range) {
            errors.insert(RobotError::JointPositionLimitsViolation);
        }
        let twist = shifted(&flange_jacobian, &flange, &flange_from_ee) * dq;
        if twist.fixed_rows::<3>(0).norm() > self.limits.translation.velocity + MEASURED_VELOCITY_MARGIN {
            errors.insert(RobotError::CartesianVelocityViolation);
        }
        self.began_in_self_collision &= *self_collision;
        if *self_collision && !self.began_in_self_collision {
            errors.insert(RobotError::SelfCollisionAvoidanceViolation);
        }
        if !errors.is_empty() {
            self.abort(errors);
        }
    }
}
