//! The robot's state, sent 1000 times per second.

use super::codec::{Codec, Decoder, Encoder};
use super::modes::{ControllerMode, MotionGeneratorMode, RobotMode};
use super::version::Version;
use crate::wire::robot_error::RobotErrors;
use crate::wire_error::WireError;

/// Size of a state in version 5, in bytes.
pub const STATE_SIZE_V5: usize = 2373;
/// Size of a state in version 10, in bytes.
pub const STATE_SIZE_V10: usize = 1377;

/// A homogeneous transform, column by column; `base_from_ee[12..15]` is the translation in metres.
pub type Transform = [f64; 16];

/// The identity transform.
pub(crate) const IDENTITY: Transform = [1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1.];

/// The state that the robot sends every millisecond. The names in parentheses are libfranka's.
///
/// # Units and frames
/// Units are rad, m, kg, N, N·m and seconds. `base` is libfranka's frame `O`, `flange` is `F`, `ne` is the nominal end
/// effector `NE`, `ee` is the end effector `EE`, and `stiffness` is `K`.
#[derive(Debug, Clone, PartialEq)]
pub struct RobotState {
    /// Milliseconds since the robot started; a command carries the number of the state that it answers.
    pub message_id: u64,
    /// Measured pose of the end effector (`O_T_EE`).
    pub base_from_ee: Transform,
    /// Pose of the end effector according to the reference (`O_T_EE_d`).
    pub base_from_ee_desired: Transform,
    /// End effector relative to the flange (`F_T_EE`).
    pub flange_from_ee: Transform,
    /// Stiffness frame relative to the end effector (`EE_T_K`).
    pub ee_from_stiffness: Transform,
    /// Nominal end effector relative to the flange (`F_T_NE`).
    pub flange_from_ne: Transform,
    /// End effector relative to the nominal one (`NE_T_EE`).
    pub ne_from_ee: Transform,
    /// Mass of the end effector (`m_ee`).
    pub ee_mass: f64,
    /// Inertia of the end effector (`I_ee`).
    pub ee_inertia: [f64; 9],
    /// Centre of mass of the end effector relative to the flange (`F_x_Cee`).
    pub ee_center: [f64; 3],
    /// Mass of the load (`m_load`).
    pub load_mass: f64,
    /// Inertia of the load (`I_load`).
    pub load_inertia: [f64; 9],
    /// Centre of mass of the load relative to the flange (`F_x_Cload`).
    pub load_center: [f64; 3],
    /// Position of joint 3 and sign of joint 4.
    pub elbow: [f64; 2],
    /// The reference's elbow (`elbow_d`).
    pub elbow_desired: [f64; 2],
    /// Measured torques (`tau_J`).
    pub torque: [f64; 7],
    /// Commanded torques without gravity (`tau_J_d`).
    pub torque_desired: [f64; 7],
    /// Derivative of the measured torques (`dtau_J`).
    pub torque_rate: [f64; 7],
    /// Measured joint positions (`q`).
    pub q: [f64; 7],
    /// Reference positions (`q_d`).
    pub q_desired: [f64; 7],
    /// Measured joint velocities (`dq`).
    pub dq: [f64; 7],
    /// Reference velocities (`dq_d`).
    pub dq_desired: [f64; 7],
    /// Reference accelerations (`ddq_d`).
    pub ddq_desired: [f64; 7],
    /// Above zero for joints in contact.
    pub joint_contact: [f64; 7],
    /// Above zero for directions in contact.
    pub cartesian_contact: [f64; 6],
    /// Above zero for joints in collision, until the recovery.
    pub joint_collision: [f64; 7],
    /// Above zero for directions in collision, until the recovery.
    pub cartesian_collision: [f64; 6],
    /// Estimated external torques (`tau_ext_hat_filtered`).
    pub external_torque: [f64; 7],
    /// Estimated wrench at the stiffness frame, in the base frame (`O_F_ext_hat_K`).
    pub external_wrench_in_base: [f64; 6],
    /// Estimated wrench at the stiffness frame, in the stiffness frame (`K_F_ext_hat_K`).
    pub external_wrench_in_stiffness: [f64; 6],
    /// The reference's twist in the base frame (`O_dP_EE_d`).
    pub twist_desired: [f64; 6],
    /// Acceleration of the base (`O_ddP_O`).
    pub base_acceleration: [f64; 3],
    /// Last commanded elbow (`elbow_c`).
    pub elbow_commanded: [f64; 2],
    /// Velocity of the commanded elbow (`delbow_c`).
    pub elbow_velocity_commanded: [f64; 2],
    /// Acceleration of the commanded elbow (`ddelbow_c`).
    pub elbow_acceleration_commanded: [f64; 2],
    /// Last commanded pose (`O_T_EE_c`).
    pub base_from_ee_commanded: Transform,
    /// Last commanded twist (`O_dP_EE_c`).
    pub twist_commanded: [f64; 6],
    /// Derivative of the commanded twist (`O_ddP_EE_c`).
    pub twist_rate_commanded: [f64; 6],
    /// Motor positions (`theta`).
    pub theta: [f64; 7],
    /// Motor velocities (`dtheta`).
    pub dtheta: [f64; 7],
    /// The running generator.
    pub motion_generator_mode: MotionGeneratorMode,
    /// The running controller.
    pub controller_mode: ControllerMode,
    /// Present errors (`current_errors` in libfranka).
    pub errors: RobotErrors,
    /// The errors that ended the last motion (`last_motion_errors`).
    pub reflex_reason: RobotErrors,
    /// The robot's mode.
    pub robot_mode: RobotMode,
    /// Fraction of the last 100 commands that were received in time; 0 outside motions.
    pub control_command_success_rate: f64,
}

impl Default for RobotState {
    fn default() -> Self {
        Self {
            message_id: 0,
            base_from_ee: IDENTITY,
            base_from_ee_desired: IDENTITY,
            flange_from_ee: IDENTITY,
            ee_from_stiffness: IDENTITY,
            flange_from_ne: IDENTITY,
            ne_from_ee: IDENTITY,
            ee_mass: 0.0,
            ee_inertia: [0.0; 9],
            ee_center: [0.0; 3],
            load_mass: 0.0,
            load_inertia: [0.0; 9],
            load_center: [0.0; 3],
            elbow: [0.0; 2],
            elbow_desired: [0.0; 2],
            torque: [0.0; 7],
            torque_desired: [0.0; 7],
            torque_rate: [0.0; 7],
            q: [0.0; 7],
            q_desired: [0.0; 7],
            dq: [0.0; 7],
            dq_desired: [0.0; 7],
            ddq_desired: [0.0; 7],
            joint_contact: [0.0; 7],
            cartesian_contact: [0.0; 6],
            joint_collision: [0.0; 7],
            cartesian_collision: [0.0; 6],
            external_torque: [0.0; 7],
            external_wrench_in_base: [0.0; 6],
            external_wrench_in_stiffness: [0.0; 6],
            twist_desired: [0.0; 6],
            base_acceleration: [0.0; 3],
            elbow_commanded: [0.0; 2],
            elbow_velocity_commanded: [0.0; 2],
            elbow_acceleration_commanded: [0.0; 2],
            base_from_ee_commanded: IDENTITY,
            twist_commanded: [0.0; 6],
            twist_rate_commanded: [0.0; 6],
            theta: [0.0; 7],
            dtheta: [0.0; 7],
            motion_generator_mode: MotionGeneratorMode::Idle,
            controller_mode: ControllerMode::Other,
            errors: RobotErrors::default(),
            reflex_reason: RobotErrors::default(),
            robot_mode: RobotMode::Other,
            control_command_success_rate: 0.0,
        }
    }
}

impl RobotState {
    /// The datagram.
    pub fn encode(&self, version: Version) -> Vec<u8> {
        let mut encoder = Encoder::new(version.state_real());
        // Encoding never fails.
        let _ = self.clone().fields(&mut encoder, version);
        encoder.into_bytes()
    }

    /// Reads a datagram.
    ///
    /// # Errors
    /// [`WireError`] for a wrong size or an unknown mode.
    pub fn decode(bytes: &[u8], version: Version) -> Result<Self, WireError> {
        let mut state = Self::default();
        let mut decoder = Decoder::new("state", bytes, version.state_real());
        state.fields(&mut decoder, version)?;
        decoder.finish()?;
        Ok(state)
    }

    fn fields(&mut self, codec: &mut impl Codec, version: Version) -> Result<(), WireError> {
        codec.u64(&mut self.message_id)?;
        for transform in [
            &mut self.base_from_ee,
            &mut self.base_from_ee_desired,
            &mut self.flange_from_ee,
            &mut self.ee_from_stiffness,
            &mut self.flange_from_ne,
            &mut self.ne_from_ee,
        ] {
            codec.reals(transform)?;
        }
        codec.reals(std::slice::from_mut(&mut self.ee_mass))?;
        codec.reals(&mut self.ee_inertia)?;
        codec.reals(&mut self.ee_center)?;
        codec.reals(std::slice::from_mut(&mut self.load_mass))?;
        codec.reals(&mut self.load_inertia)?;
        codec.reals(&mut self.load_center)?;
        codec.reals(&mut self.elbow)?;
        codec.reals(&mut self.elbow_desired)?;
        for joints in [
            &mut self.torque,
            &mut self.torque_desired,
            &mut self.torque_rate,
            &mut self.q,
            &mut self.q_desired,
            &mut self.dq,
            &mut self.dq_desired,
            &mut self.ddq_desired,
            &mut self.joint_contact,
        ] {
            codec.reals(joints)?;
        }
        codec.reals(&mut self.cartesian_contact)?;
        codec.reals(&mut self.joint_collision)?;
        codec.reals(&mut self.cartesian_collision)?;
        codec.reals(&mut self.external_torque)?;
        codec.reals(&mut self.external_wrench_in_base)?;
        codec.reals(&mut self.external_wrench_in_stiffness)?;
        codec.reals(&mut self.twist_desired)?;
        codec.reals(&mut self.base_acceleration)?;
        codec.reals(&mut self.elbow_commanded)?;
        codec.reals(&mut self.elbow_velocity_commanded)?;
        codec.reals(&mut self.elbow_acceleration_commanded)?;
        codec.reals(&mut self.base_from_ee_commanded)?;
        codec.reals(&mut self.twist_commanded)?;
        codec.reals(&mut self.twist_rate_commanded)?;
        codec.reals(&mut self.theta)?;
        codec.reals(&mut self.dtheta)?;
        if version == Version::V10 {
            // Two accelerometers of three axes on six links, which this crate does not read.
            codec.reals(&mut [0.0; 36])?;
        }
        self.modes(codec)?;
        codec.reals(std::slice::from_mut(&mut self.control_command_success_rate))
    }

    fn modes(&mut self, codec: &mut impl Codec) -> Result<(), WireError> {
        let mut byte = self.motion_generator_mode as u8;
        codec.u8(&mut byte)?;
        self.motion_generator_mode = MotionGeneratorMode::from_byte(byte)?;
        byte = self.controller_mode as u8;
        codec.u8(&mut byte)?;
        self.controller_mode = ControllerMode::from_byte(byte)?;
        self.errors.field(codec)?;
        self.reflex_reason.field(codec)?;
        byte = self.robot_mode as u8;
        codec.u8(&mut byte)?;
        self.robot_mode = RobotMode::from_byte(byte)?;
        Ok(())
    }
}
