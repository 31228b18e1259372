//! External torques as the robot estimates them, and the thresholds for contacts and collisions.

use nalgebra::{Isometry3, SMatrix, Vector6};

use super::plant::{Jacobian, JointVector};
use super::reference::PERIOD_SECS;
use crate::wire::CollisionBehavior;
use crate::wire::robot_error::{RobotError, RobotErrors};

/// Cut-off frequency of the estimate's low-pass filter.
const CUTOFF_HZ: f64 = 30.0;
/// Reference acceleration of a joint, rad/s², above which the thresholds for acceleration apply.
const ACCELERATING: f64 = 0.05;

/// The estimated external forces, and the contacts and collisions that follow from them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contacts {
    /// External joint torques, N·m.
    pub torque: JointVector,
    /// Wrench at the origin of the stiffness frame, in the base frame, N and N·m.
    pub wrench_in_base: Vector6<f64>,
    /// The same wrench in the stiffness frame, N and N·m.
    pub wrench_in_stiffness: Vector6<f64>,
    /// Joints in contact.
    pub joint_contact: [bool; 7],
    /// Directions in contact.
    pub cartesian_contact: [bool; 6],
    /// Joints in collision.
    pub joint_collision: [bool; 7],
    /// Directions in collision.
    pub cartesian_collision: [bool; 6],
}

impl Default for Contacts {
    fn default() -> Self {
        Self {
            torque: JointVector::zeros(),
            wrench_in_base: Vector6::zeros(),
            wrench_in_stiffness: Vector6::zeros(),
            joint_contact: [false; 7],
            cartesian_contact: [false; 6],
            joint_collision: [false; 7],
            cartesian_collision: [false; 6],
        }
    }
}

impl Contacts {
    /// Updates the estimate after one cycle. `torque` is the present external torque, `jacobian` the Jacobian of the
    /// origin of the stiffness frame.
    pub fn update(
        &mut self,
        torque: &JointVector,
        jacobian: &Jacobian,
        base_from_stiffness: &Isometry3<f64>,
        ddq_desired: &JointVector,
        thresholds: &CollisionBehavior,
    ) {
        let gain = PERIOD_SECS / (PERIOD_SECS + 1.0 / (std::f64::consts::TAU * CUTOFF_HZ));
        self.torque += (torque - self.torque) * gain;
        // Least squares for `Jᵀ F = τ`, damped at singular poses.
        let square = jacobian * jacobian.transpose() + SMatrix::<f64, 6, 6>::identity() * 1e-4;
        self.wrench_in_base =
            square.cholesky().map_or_else(Vector6::zeros, |factor| factor.solve(&(jacobian * self.torque)));
        let to_stiffness = base_from_stiffness.rotation.inverse();
        let force = to_stiffness * self.wrench_in_base.fixed_rows::<3>(0).into_owned();
        let moment = to_stiffness * self.wrench_in_base.fixed_rows::<3>(3).into_owned();
        self.wrench_in_stiffness = Vector6::new(force.x, force.y, force.z, moment.x, moment.y, moment.z);

        let is_accelerating = ddq_desired.amax() > ACCELERATING;
        let (lower_torque, upper_torque, lower_force, upper_force) = if is_accelerating {
            (
                thresholds.lower_torque_acceleration,
                thresholds.upper_torque_acceleration,
                thresholds.lower_force_acceleration,
                thresholds.upper_force_acceleration,
            )
        } else {
            (
                thresholds.lower_torque_nominal,
                thresholds.upper_torque_nominal,
                thresholds.lower_force_nominal,
                thresholds.upper_force_nominal,
            )
        };
        self.joint_contact = std::array::from_fn(|joint| self.torque[joint].abs() > lower_torque[joint]);
        self.joint_collision = std::array::from_fn(|joint| self.torque[joint].abs() > upper_torque[joint]);
        self.cartesian_contact = std::array::from_fn(|axis| self.wrench_in_stiffness[axis].abs() > lower_force[axis]);
        self.cartesian_collision = std::array::from_fn(|axis| self.wrench_in_stiffness[axis].abs() > upper_force[axis]);
    }

    /// The reflexes caused by the collisions.
    pub fn reflexes(&self) -> RobotErrors {
        let joint = self.joint_collision.contains(&true).then_some(RobotError::JointReflex);
        let cartesian = self.cartesian_collision.contains(&true).then_some(RobotError::CartesianReflex);
        joint.into_iter().chain(cartesian).collect()
    }
}
