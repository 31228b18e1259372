//! The client's answer to a state.

use super::codec::{Codec, Decoder, Encoder, Real};
use super::state::{IDENTITY, Transform};
use super::version::Version;
use crate::wire_error::WireError;

/// Size of a command in version 5, in bytes.
pub const COMMAND_SIZE_V5: usize = 370;
/// Size of a command in version 10, in bytes.
pub const COMMAND_SIZE_V10: usize = 371;

/// The data for a motion generator; the running Move determines which fields are used.
#[derive(Debug, Clone, PartialEq)]
pub struct MotionCommand {
    /// Joint positions, rad (`q_c`).
    pub q: [f64; 7],
    /// Joint velocities, rad/s (`dq_c`).
    pub dq: [f64; 7],
    /// Pose of the end effector (`O_T_EE_c`).
    pub base_from_ee: Transform,
    /// Twist of the end effector in the base frame, m/s and rad/s (`O_dP_EE_c`).
    pub twist: [f64; 6],
    /// Position of joint 3 and sign of joint 4, if `valid_elbow`.
    pub elbow: [f64; 2],
    /// Whether `elbow` is valid.
    pub valid_elbow: bool,
    /// Whether this is the last command of the motion.
    pub finished: bool,
}

impl Default for MotionCommand {
    fn default() -> Self {
        Self {
            q: [0.0; 7],
            dq: [0.0; 7],
            base_from_ee: IDENTITY,
            twist: [0.0; 6],
            elbow: [0.0; 2],
            valid_elbow: false,
            finished: false,
        }
    }
}

/// The client's command for one millisecond.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RobotCommand {
    /// Number of the answered state.
    pub message_id: u64,
    /// Command for the motion generator.
    pub motion: MotionCommand,
    /// Torques without gravity, N·m (`tau_J_d`).
    pub torque: [f64; 7],
    /// Whether the torque control ends (only version 10).
    pub torque_finished: bool,
}

impl RobotCommand {
    /// The datagram.
    pub fn encode(&self, version: Version) -> Vec<u8> {
        let mut encoder = Encoder::new(Real::F64);
        // Encoding never fails.
        let _ = self.clone().fields(&mut encoder, version);
        encoder.into_bytes()
    }

    /// Reads a datagram.
    ///
    /// # Errors
    /// [`WireError`] for a wrong size.
    pub fn decode(bytes: &[u8], version: Version) -> Result<Self, WireError> {
        let mut command = Self::default();
        let mut decoder = Decoder::new("command", bytes, Real::F64);
        command.fields(&mut decoder, version)?;
        decoder.finish()?;
        Ok(command)
    }

    fn fields(&mut self, codec: &mut impl Codec, version: Version) -> Result<(), WireError> {
        codec.u64(&mut self.message_id)?;
        codec.f64s(&mut self.motion.q)?;
        codec.f64s(&mut self.motion.dq)?;
        codec.f64s(&mut self.motion.base_from_ee)?;
        codec.f64s(&mut self.motion.twist)?;
        codec.f64s(&mut self.motion.elbow)?;
        codec.bool(&mut self.motion.valid_elbow)?;
        codec.bool(&mut self.motion.finished)?;
        codec.f64s(&mut self.torque)?;
        if version == Version::V10 {
            codec.bool(&mut self.torque_finished)?;
        }
        Ok(())
    }
}
