//! Whole messages from a stream.

use std::io::{self, Read};

use crate::wire::{Header, HeaderKind};
use crate::wire_error::WireError;

/// Reads the next message; the inner error is a header that cannot be.
///
/// Memory is taken as bytes arrive, never by what a header announces.
///
/// # Errors
/// The stream's end or its error.
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
    stream.by_ref().take(size as u64).read_to_end(&mut payload)?;
    if payload.len() < size {
        return Err(io::ErrorKind::UnexpectedEof.into());
    }
    Ok(Ok((header, payload)))
}
