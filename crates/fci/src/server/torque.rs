//! The robot's own controllers: torques that follow a reference, without gravity.

use nalgebra::{Isometry3, SMatrix, Vector6};

use super::plant::{Jacobian, JointVector, Observation};
use super::reference::JointReference;
use crate::pose::difference;

/// Damping ratio of both controllers.
const DAMPING_RATIO: f64 = 0.7;
/// Stiffness, N·m/rad, that holds the elbow while the end effector is controlled.
const NULLSPACE_STIFFNESS: f64 = 20.0;

/// Joint impedance: `K (q_d - q) + D (dq_d - dq) + M ddq_d + coriolis`, with `K` in N·m/rad.
///
/// `D` is computed for each joint from its own inertia.
pub fn joint_impedance(robot: &Observation, reference: &JointReference, stiffness: &JointVector) -> JointVector {
    let spring = stiffness.component_mul(&(reference.q - robot.q));
    let damping =
        JointVector::from_fn(|joint, _| 2.0 * DAMPING_RATIO * (stiffness[joint] * robot.mass[(joint, joint)]).sqrt());
    spring + damping.component_mul(&(reference.dq - robot.dq)) + robot.mass * reference.ddq + robot.coriolis
}

/// The data of the end effector for Cartesian impedance.
#[derive(Debug, Clone, Copy)]
pub struct EndEffector {
    /// Measured pose of the end effector.
    pub base_from_ee: Isometry3<f64>,
    /// Jacobian of the end effector at the measured positions.
    pub jacobian: Jacobian,
    /// Desired pose of the end effector.
    pub base_from_ee_desired: Isometry3<f64>,
    /// Desired twist, m/s and rad/s in the base frame.
    pub twist_desired: Vector6<f64>,
}

/// Impedance of the end effector: `Jᵀ (K e + D (v_d - J dq)) + M ddq_d + coriolis`, and a weak impedance of the elbow
/// in the null space. `K` is in N/m and N·m/rad along the base's axes; `D` is computed for each direction from the
/// effective inertia in this direction.
pub fn cartesian_impedance(
    robot: &Observation,
    end_effector: &EndEffector,
    reference: &JointReference,
    stiffness: &[f64; 6],
) -> JointVector {
    let EndEffector { base_from_ee, jacobian, base_from_ee_desired, twist_desired } = end_effector;
    let felt_inertia = operational_inertia(robot, jacobian);
    let error = difference(base_from_ee, base_from_ee_desired);
    let rate = twist_desired - jacobian * robot.dq;
    let wrench = Vector6::from_fn(|axis, _| {
        let damping = 2.0 * DAMPING_RATIO * (stiffness[axis] * felt_inertia[(axis, axis)].max(0.0)).sqrt();
        stiffness[axis] * error[axis] + damping * rate[axis]
    });
    let elbow =
        (reference.q - robot.q) * NULLSPACE_STIFFNESS + (reference.dq - robot.dq) * (2.0 * NULLSPACE_STIFFNESS.sqrt());
    // Subtracting `felt_by_ee` leaves the part of the elbow's torque that does not accelerate the end effector.
    let inverse = robot.mass.try_inverse().unwrap_or_else(SMatrix::identity);
    let felt_by_ee = jacobian.transpose() * (felt_inertia * (jacobian * (inverse * elbow)));
    jacobian.transpose() * wrench + (elbow - felt_by_ee) + robot.mass * reference.ddq + robot.coriolis
}

/// The effective inertia at the end effector: `(J M⁻¹ Jᵀ)⁻¹`, damped at singular poses.
fn operational_inertia(robot: &Observation, jacobian: &Jacobian) -> SMatrix<f64, 6, 6> {
    let inverse = robot.mass.try_inverse().unwrap_or_else(SMatrix::identity);
    let mobility = jacobian * inverse * jacobian.transpose() + SMatrix::<f64, 6, 6>::identity() * 1e-4;
    mobility.try_inverse().unwrap_or_else(SMatrix::identity)
}

/// The torques that hold a load of `mass` kg against gravity; `lever` points from the flange to its centre (m, base
/// frame).
pub fn load_gravity(mass: f64, flange_jacobian: &Jacobian, lever: &nalgebra::Vector3<f64>) -> JointVector {
    const GRAVITY_M_S2: f64 = 9.81;
    JointVector::from_fn(|joint, _| {
        let column = flange_jacobian.column(joint);
        let (linear, angular) = (column.fixed_rows::<3>(0), column.fixed_rows::<3>(3));
        // Vertical speed of the load's centre per rad/s of the joint.
        let vertical = linear[2] + angular[0] * lever[1] - angular[1] * lever[0];
        mass * GRAVITY_M_S2 * vertical
    })
}
