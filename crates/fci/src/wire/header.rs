//! The header of every message over TCP.

use super::codec::{Codec, Decoder, Encoder, Real};
use crate::wire_error::WireError;

/// Size of the robot's header in bytes.
pub const HEADER_SIZE: usize = 12;
/// Size of the hand's header in bytes.
pub const HAND_HEADER_SIZE: usize = 10;
/// Maximum size of a message over TCP, in bytes; the largest one is the robot's description in version 10 (about 30
/// kB).
pub const MAX_MESSAGE_SIZE: u32 = 4 << 20;

/// The kind of header: the robot's command number has four bytes, the hand's two.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum HeaderKind {
    /// 12 bytes.
    Robot,
    /// 10 bytes.
    Hand,
}

impl HeaderKind {
    /// Size in bytes.
    pub const fn size(self) -> usize {
        match self {
            HeaderKind::Robot => HEADER_SIZE,
            HeaderKind::Hand => HAND_HEADER_SIZE,
        }
    }
}

/// The command of a message, and its length.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Header {
    /// Number of the command.
    pub command: u32,
    /// Number of the request, chosen by the client and repeated in the response.
    pub command_id: u32,
    /// Size of header and payload in bytes.
    pub size: u32,
}

impl Header {
    /// A whole message: a header with the right size, then the payload.
    pub fn message(kind: HeaderKind, command: u32, command_id: u32, payload: &[u8]) -> Vec<u8> {
        let mut header = Self { command, command_id, size: (kind.size() + payload.len()) as u32 };
        let mut encoder = Encoder::new(Real::F64);
        // Encoding never fails.
        let _ = header.fields(&mut encoder, kind);
        let mut bytes = encoder.into_bytes();
        bytes.extend_from_slice(payload);
        bytes
    }

    /// Reads a header.
    ///
    /// # Errors
    /// [`WireError`] for fewer bytes than a header has, and for a size below the header's or above
    /// [`MAX_MESSAGE_SIZE`].
    pub fn decode(bytes: &[u8], kind: HeaderKind) -> Result<Self, WireError> {
        let mut header = Self { command: 0, command_id: 0, size: 0 };
        header.fields(&mut Decoder::new("header", bytes, Real::F64), kind)?;
        if (header.size as usize) < kind.size() || header.size > MAX_MESSAGE_SIZE {
            return Err(WireError::MessageSize { min: kind.size() as u32, max: MAX_MESSAGE_SIZE, found: header.size });
        }
        Ok(header)
    }

    /// Size of the payload in bytes.
    pub fn payload_size(&self, kind: HeaderKind) -> usize {
        self.size as usize - kind.size()
    }

    fn fields(&mut self, codec: &mut impl Codec, kind: HeaderKind) -> Result<(), WireError> {
        match kind {
            HeaderKind::Robot => codec.u32(&mut self.command)?,
            HeaderKind::Hand => {
                let mut command = self.command as u16;
                codec.u16(&mut command)?;
                self.command = command.into();
            }
        }
        codec.u32(&mut self.command_id)?;
        codec.u32(&mut self.size)
    }
}
