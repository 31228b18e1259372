//! The hand's protocol, version 3.

use super::codec::{Codec, Decoder, Encoder, Real};
use super::header::{Header, HeaderKind};
use crate::wire_error::WireError;

/// The version of the hand's protocol.
pub const HAND_VERSION: u16 = 3;

/// Number of a command.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u16)]
pub enum HandCommand {
    /// Opens a session.
    Connect = 0,
    /// Closes and opens the fingers to find their range.
    Homing = 1,
    /// Closes the fingers on a part.
    Grasp = 2,
    /// Moves the fingers to a width.
    Move = 3,
    /// Stops the fingers.
    Stop = 4,
}

impl HandCommand {
    /// The name in messages.
    pub const fn name(self) -> &'static str {
        match self {
            HandCommand::Connect => "hand: connect",
            HandCommand::Homing => "hand: homing",
            HandCommand::Grasp => "hand: grasp",
            HandCommand::Move => "hand: move",
            HandCommand::Stop => "hand: stop",
        }
    }

    fn from_number(number: u32) -> Result<Self, WireError> {
        [HandCommand::Connect, HandCommand::Homing, HandCommand::Grasp, HandCommand::Move, HandCommand::Stop]
            .into_iter()
            .find(|&command| command as u32 == number)
            .ok_or(WireError::Value { field: "hand command", found: number })
    }
}

/// The requests of a client to the hand. Widths in m, speeds in m/s, forces in N.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum HandRequest {
    /// Opens a session; states go to the UDP port.
    Connect {
        /// The client's version.
        version: u16,
        /// The client's UDP port.
        udp_port: u16,
    },
    /// Measures the range of the fingers.
    Homing,
    /// Closes to a width and presses; successful if the fingers end between `width - epsilon_inner` and `width +
    /// epsilon_outer`.
    Grasp {
        /// The part's width, m.
        width: f64,
        /// Tolerance below the width, m.
        epsilon_inner: f64,
        /// Tolerance above the width, m.
        epsilon_outer: f64,
        /// Closing speed, m/s.
        speed: f64,
        /// Force, N.
        force: f64,
    },
    /// Moves the fingers to a width.
    Move {
        /// Distance between the fingers, m.
        width: f64,
        /// Speed, m/s.
        speed: f64,
    },
    /// Stops the fingers and ends a grasp.
    Stop,
}

impl HandRequest {
    /// The command of this request.
    pub fn command(&self) -> HandCommand {
        match self {
            HandRequest::Connect { .. } => HandCommand::Connect,
            HandRequest::Homing => HandCommand::Homing,
            HandRequest::Grasp { .. } => HandCommand::Grasp,
            HandRequest::Move { .. } => HandCommand::Move,
            HandRequest::Stop => HandCommand::Stop,
        }
    }

    /// The message, including its header.
    pub fn encode(&self, command_id: u32) -> Vec<u8> {
        let mut encoder = Encoder::new(Real::F64);
        // An encoder has no error.
        let _ = self.clone().fields(&mut encoder);
        Header::message(HeaderKind::Hand, self.command() as u32, command_id, &encoder.into_bytes())
    }

    /// Reads the payload of a request.
    ///
    /// # Errors
    /// [`WireError`] for an unknown command or a wrong size.
    pub fn decode(header: &Header, payload: &[u8]) -> Result<Self, WireError> {
        let mut request = match HandCommand::from_number(header.command)? {
            HandCommand::Connect => HandRequest::Connect { version: 0, udp_port: 0 },
            HandCommand::Homing => HandRequest::Homing,
            HandCommand::Grasp => {
                HandRequest::Grasp { width: 0.0, epsilon_inner: 0.0, epsilon_outer: 0.0, speed: 0.0, force: 0.0 }
            }
            HandCommand::Move => HandRequest::Move { width: 0.0, speed: 0.0 },
            HandCommand::Stop => HandRequest::Stop,
        };
        let mut decoder = Decoder::new("request to the hand", payload, Real::F64);
        request.fields(&mut decoder)?;
        decoder.finish()?;
        Ok(request)
    }

    fn fields(&mut self, codec: &mut impl Codec) -> Result<(), WireError> {
        match self {
            HandRequest::Connect { version, udp_port } => {
                codec.u16(version)?;
                codec.u16(udp_port)
            }
            HandRequest::Grasp { width, epsilon_inner, epsilon_outer, speed, force } => {
                [width, epsilon_inner, epsilon_outer, speed, force].into_iter().try_for_each(|value| codec.f64(value))
            }
            HandRequest::Move { width, speed } => [width, speed].into_iter().try_for_each(|value| codec.f64(value)),
            HandRequest::Homing | HandRequest::Stop => Ok(()),
        }
    }
}

/// The result of a hand command.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u16)]
pub enum HandStatus {
    /// Done.
    Success = 0,
    /// The command failed; as an answer to Connect: the hand uses another version.
    Fail = 1,
    /// Done, but the width is not within the tolerance.
    Unsuccessful = 2,
    /// Another command ended the motion.
    Aborted = 3,
}

impl HandStatus {
    /// Reads the start of a response's payload.
    ///
    /// # Errors
    /// [`WireError`] for fewer than two bytes or an unknown status.
    pub fn decode(payload: &[u8]) -> Result<Self, WireError> {
        let mut number = 0;
        Decoder::new("response of the hand", payload, Real::F64).u16(&mut number)?;
        [HandStatus::Success, HandStatus::Fail, HandStatus::Unsuccessful, HandStatus::Aborted]
            .into_iter()
            .find(|&status| status as u16 == number)
            .ok_or(WireError::Value { field: "status of the hand", found: number.into() })
    }

    /// The response, including its header; a response to Connect also contains the server's version.
    pub fn encode(self, command: HandCommand, command_id: u32) -> Vec<u8> {
        let mut payload = (self as u16).to_le_bytes().to_vec();
        if command == HandCommand::Connect {
            payload.extend(HAND_VERSION.to_le_bytes());
        }
        Header::message(HeaderKind::Hand, command as u32, command_id, &payload)
    }
}

/// The hand's state.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct HandState {
    /// Number of the state: milliseconds, which wrap around.
    pub message_id: u32,
    /// Distance between the fingers, m.
    pub width: f64,
    /// Largest distance between the fingers, found by homing, m.
    pub max_width: f64,
    /// Whether the last grasp holds an object.
    pub is_grasped: bool,
    /// Temperature, °C.
    pub temperature: u16,
}

impl HandState {
    /// The datagram.
    pub fn encode(&self) -> Vec<u8> {
        let mut encoder = Encoder::new(Real::F64);
        // An encoder has no error.
        let _ = self.clone().fields(&mut encoder);
        encoder.into_bytes()
    }

    /// Reads a datagram.
    ///
    /// # Errors
    /// [`WireError`] for a wrong size.
    pub fn decode(bytes: &[u8]) -> Result<Self, WireError> {
        let mut state = Self::default();
        let mut decoder = Decoder::new("state of the hand", bytes, Real::F64);
        state.fields(&mut decoder)?;
        decoder.finish()?;
        Ok(state)
    }

    fn fields(&mut self, codec: &mut impl Codec) -> Result<(), WireError> {
        codec.u32(&mut self.message_id)?;
        codec.f64(&mut self.width)?;
        codec.f64(&mut self.max_width)?;
        codec.bool(&mut self.is_grasped)?;
        codec.u16(&mut self.temperature)
    }
}
