//! Reads whole messages from a stream.

use std::io::{self, Read};

use crate::wire::{Header, HeaderKind};
use crate::wire_error::WireError;

/// Step in which memory for a message is allocated while its bytes arrive: a header that announces a large message
/// costs little memory.
const STEP: usize = 8192;

/// Reads the next message; the inner error is an invalid header.
///
/// Memory is allocated while bytes arrive, and never more than the message needs.
///
/// # Errors
/// An error of the stream, or its end before the end of the message.
pub fn read_message(
    stream: &mut impl Read,
    kind: HeaderKind,
) -> io::Result<std::result::Result<(Header, Vec<u8>), WireError>> {
    let mut bytes = vec![0; kind.size()];
    stream.read_exact(&mut bytes)?;
    let header = match Header::decode(&bytes, kind) {
        Ok(header) => header,
        Err(error) => return Ok(Err(error)),
    };
    let size = header.payload_size(kind);
    let mut payload = Vec::new();
    while payload.len() < size {
        let arrived = payload.len();
        let step = STEP.min(size - arrived);
        payload.reserve_exact(step);
        payload.resize(arrived + step, 0);
        stream.read_exact(&mut payload[arrived..])?;
    }
    Ok(Ok((header, payload)))
}
