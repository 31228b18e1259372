//! Computed torque control: the arm follows a reference in joint space.
//!
//! `tau = M(q) (qdd_ref + Kp (q_ref - q) + Kd (qd_ref - qd)) + bias(q, qd) - passive(q, qd)`, clamped at the motors'
//! limits. Within these limits and with the model's own mass matrix, the error of every joint decays like a critically
//! damped oscillator in any posture. The bias does not include a grasped part; at this stiffness a part causes an error
//! of a fraction of a millimetre.

use crate::data::Data;
use crate::panda::{ArmVector, NUM_ARM_JOINTS, PandaIds};

/// A joint-space reference at one instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ArmReference {
    /// Positions in radians.
    pub position: ArmVector,
    /// Velocities in rad/s.
    pub velocity: ArmVector,
    /// Accelerations in rad/s².
    pub acceleration: ArmVector,
}

impl ArmReference {
    /// A reference at rest at a configuration.
    pub fn at_rest(position: ArmVector) -> Self {
        Self { position, velocity: ArmVector::zeros(), acceleration: ArmVector::zeros() }
    }
}

/// The controller's gains and limits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ArmController {
    /// Natural frequency of the error's decay in rad/s; `Kp` is its square.
    pub frequency_rad_s: f64,
    /// Damping ratio; 1 is critical.
    pub damping_ratio: f64,
    /// Largest torque of each motor in N·m.
    pub max_torque_nm: ArmVector,
}

impl Default for ArmController {
    /// About 5 Hz, critically damped, Franka's torques.
    fn default() -> Self {
        Self {
            frequency_rad_s: 30.0,
            damping_ratio: 1.0,
            max_torque_nm: sdg_kinematics::JointLimits::panda().torque_max,
        }
    }
}

impl ArmController {
    /// The torques for this instant, in N·m, within the limits.
    ///
    /// `data` must contain the values that follow from positions and velocities (after [`Data::step1`]).
    pub fn torque_nm(&self, data: &Data, panda: &PandaIds, reference: &ArmReference) -> ArmVector {
        let kp = self.frequency_rad_s * self.frequency_rad_s;
        let kd = 2.0 * self.damping_ratio * self.frequency_rad_s;
        let wanted = reference.acceleration
            + kp * (reference.position - panda.position(data))
            + kd * (reference.velocity - panda.velocity(data));

        let joints = panda.qvel_indices();
        let mass = data.mass_matrix();
        let (bias, passive) = (data.qfrc_bias(), data.qfrc_passive());
        ArmVector::from_fn(|row, _| {
            let inertial: f64 =
                (0..NUM_ARM_JOINTS).map(|column| mass[(joints[row], joints[column])] * wanted[column]).sum();
            let torque = inertial + bias[joints[row]] - passive[joints[row]];
            torque.clamp(-self.max_torque_nm[row], self.max_torque_nm[row])
        })
    }

    /// Sets the arm's motors for this instant; see [`ArmController::torque_nm`].
    pub fn apply(&self, data: &mut Data, panda: &PandaIds, reference: &ArmReference) {
        let torque = self.torque_nm(data, panda, reference);
        for (motor, torque) in panda.motors.iter().zip(torque.iter()) {
            data.ctrl_mut()[motor.index()] = *torque;
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use sdg_kinematics::{ArmGeometry, JointLimits, Trajectory, ready_pose};

    use super::*;
    use crate::model::Model;
    use crate::panda::panda_asset;

    fn arm() -> (Data, PandaIds) {
        let xml = "<mujoco><compiler angle='radian'/><option timestep='0.001' integrator='implicit'/>\
                   <include file='panda.xml'/></mujoco>";
        let model = Arc::new(Model::from_xml(xml, &[panda_asset()]).unwrap());
        let ids = PandaIds::find(&model).unwrap();
        (Data::new(model).unwrap(), ids)
    }

    #[test]
    fn it_stands_still_against_gravity() {
        let (mut data, ids) = arm();
        let controller = ArmController::default();
        let start = ready_pose();
        ids.set_position(&mut data, &start);
        for _ in 0..1000 {
            data.step1().unwrap();
            controller.apply(&mut data, &ids, &ArmReference::at_rest(start));
            data.step2().unwrap();
        }
        assert!((ids.position(&data) - start).amax() < 1e-6);
    }

    #[test]
    fn it_follows_a_fast_trajectory_within_a_milliradian() {
        let (mut data, ids) = arm();
        let controller = ArmController::default();
        let start = ready_pose();
        let end = start + ArmVector::from([0.8, 0.3, -0.5, 0.6, 0.7, -0.4, -0.9]);
        let limits = JointLimits::panda().scaled(0.6, 0.5, 0.5).unwrap();
        let trajectory = Trajectory::point_to_point(&start, &end, &limits).unwrap();
        ids.set_position(&mut data, &start);
        let mut worst: f64 = 0.0;
        let num_steps = (trajectory.duration_secs() * 1e3).ceil() as usize + 200;
        for step in 0..num_steps {
            let (position, velocity, acceleration) = trajectory.sample(step as f64 * 1e-3);
            data.step1().unwrap();
            worst = worst.max((ids.position(&data) - position).amax());
            controller.apply(&mut data, &ids, &ArmReference { position, velocity, acceleration });
            data.step2().unwrap();
        }
        assert!(worst < 2e-3, "worst error {worst} rad");
        data.forward().unwrap();
        let miss = ArmGeometry::panda().forward(&end).inverse() * ids.base_from_tcp(&data);
        assert!(miss.translation.vector.norm() < 1e-4, "missed by {} m", miss.translation.vector.norm());
    }

    #[test]
    fn torques_stay_within_the_motors_limits() {
        let (mut data, ids) = arm();
        ids.set_position(&mut data, &ready_pose());
        data.forward().unwrap();
        let far = ArmReference::at_rest(ready_pose() + ArmVector::repeat(1.0));
        let torque = ArmController::default().torque_nm(&data, &ids, &far);
        for joint in 0..NUM_ARM_JOINTS {
            assert!(torque[joint].abs() <= JointLimits::panda().torque_max[joint]);
        }
        assert_eq!(torque[0].abs(), 87.0);
    }
}
