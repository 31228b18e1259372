//! The state reported by a robot.

use nalgebra::Isometry3;

use super::frames::end_effector_at;
use super::plant::Plant;
use super::robot::RobotCore;
use super::settings::{HAND_CENTER_M, HAND_INERTIA, HAND_MASS_KG};
use crate::pose::transform;
use crate::wire::{ControllerMode, MotionGeneratorMode, RobotState};

impl RobotCore {
    /// The present state.
    pub fn state(&self, plant: &dyn Plant) -> RobotState {
        let flange_from_ee = self.settings.flange_from_ee();
        let pose_of = |pose: &Isometry3<f64>| transform(pose);
        let joints = &self.references.joints;
        let cartesian = &self.references.cartesian;
        let (measured, _) = end_effector_at(plant, &flange_from_ee, &self.observation.q);
        let (desired, jacobian_desired) = end_effector_at(plant, &flange_from_ee, &joints.q);
        let flags = |values: &[bool]| -> [f64; 7] {
            std::array::from_fn(|index| values.get(index).map_or(0.0, |&flag| f64::from(u8::from(flag))))
        };
        let six = |values: [f64; 7]| -> [f64; 6] { std::array::from_fn(|index| values[index]) };
        RobotState {
            message_id: self.time_ms,
            base_from_ee: pose_of(&measured),
            base_from_ee_desired: pose_of(&desired),
            flange_from_ee: pose_of(&flange_from_ee),
            ee_from_stiffness: pose_of(&self.settings.ee_from_stiffness),
            flange_from_ne: pose_of(&self.settings.flange_from_ne),
            ne_from_ee: pose_of(&self.settings.ne_from_ee),
            ee_mass: HAND_MASS_KG,
            ee_inertia: HAND_INERTIA,
            ee_center: HAND_CENTER_M,
            load_mass: self.settings.load.mass,
            load_inertia: self.settings.load.inertia,
            load_center: self.settings.load.center,
            elbow: self.elbow(),
            elbow_desired: super::cartesian::elbow_of(&joints.q),
            torque: self.torque.into(),
            torque_desired: self.references.torque.into(),
            torque_rate: self.torque_rate.into(),
            q: self.observation.q.into(),
            q_desired: joints.q.into(),
            dq: self.observation.dq.into(),
            dq_desired: joints.dq.into(),
            ddq_desired: joints.ddq.into(),
            joint_contact: flags(&self.contacts.joint_contact),
            cartesian_contact: six(flags(&self.contacts.cartesian_contact)),
            joint_collision: flags(&self.collisions.joint_collision),
            cartesian_collision: six(flags(&self.collisions.cartesian_collision)),
            external_torque: self.contacts.torque.into(),
            external_wrench_in_base: self.contacts.wrench_in_base.into(),
            external_wrench_in_stiffness: self.contacts.wrench_in_stiffness.into(),
            twist_desired: (jacobian_desired * joints.dq).into(),
            base_acceleration: [0.0, 0.0, -9.81],
            elbow_commanded: cartesian.elbow,
            elbow_velocity_commanded: [cartesian.elbow_velocity, 0.0],
            elbow_acceleration_commanded: [cartesian.elbow_acceleration, 0.0],
            base_from_ee_commanded: pose_of(&cartesian.pose),
            twist_commanded: cartesian.twist.into(),
            twist_rate_commanded: cartesian.twist_rate.into(),
            // The simulated gears are rigid, so that motors and joints have the same positions.
            theta: self.observation.q.into(),
            dtheta: self.observation.dq.into(),
            motion_generator_mode: self.motion.as_ref().map_or(MotionGeneratorMode::Idle, |motion| motion.generator),
            controller_mode: self.motion.as_ref().map_or(ControllerMode::Other, |motion| motion.controller),
            errors: self.errors,
            reflex_reason: self.reflex_reason,
            robot_mode: self.mode,
            control_command_success_rate: self
                .motion
                .as_ref()
                .map_or(0.0, |motion| motion.communication.success_rate()),
        }
    }
}
