//! The body of a response, with its framing removed.

use std::io::{ErrorKind, Read};
use std::net::TcpStream;
use std::time::Instant;

use super::waiting::{in_words, time_left};

/// Maximum length of a chunk's size line: hexadecimal digits and extensions.
const MAX_CHUNK_LINE_BYTES: usize = 1024;
/// Bytes per read.
const PIECE_BYTES: usize = 64 << 10;

/// The framing, which determines where a body ends.
#[derive(Debug)]
pub(super) enum Framing {
    /// After this number of bytes.
    Length { left: u64 },
    /// In chunks, each preceded by its size.
    Chunked(Chunk),
    /// When the connection is closed.
    UntilClose,
}

/// Position within the chunks.
#[derive(Debug)]
pub(super) enum Chunk {
    /// In the size line; contains the part received so far.
    Size(Vec<u8>),
    /// In the data.
    Data { left: u64 },
    /// In the line end after the data.
    LineEnd,
    /// After the last chunk.
    End,
}

impl Framing {
    pub(super) fn chunked() -> Self {
        Self::Chunked(Chunk::Size(Vec::new()))
    }

    fn has_ended(&self) -> bool {
        matches!(self, Self::Length { left: 0 } | Self::Chunked(Chunk::End))
    }

    /// Copies the body's bytes, without framing, to `out`.
    fn unframe(&mut self, mut bytes: &[u8], out: &mut Vec<u8>) -> Result<(), String> {
        while !bytes.is_empty() && !self.has_ended() {
            match self {
                Self::UntilClose => out.extend_from_slice(std::mem::take(&mut bytes)),
                Self::Length { left } => take_up_to(left, &mut bytes, out),
                Self::Chunked(chunk) => chunk.unframe(&mut bytes, out)?,
            }
        }
        Ok(())
    }
}

impl Chunk {
    fn unframe(&mut self, bytes: &mut &[u8], out: &mut Vec<u8>) -> Result<(), String> {
        match self {
            Self::Size(line) => {
                let end = bytes.iter().position(|&byte| byte == b'\n');
                line.extend_from_slice(&bytes[..end.unwrap_or(bytes.len())]);
                *bytes = end.map_or(&[], |end| &bytes[end + 1..]);
                if line.len() > MAX_CHUNK_LINE_BYTES {
                    return Err(format!(
                        "expected a chunk's size, found a line of more than {MAX_CHUNK_LINE_BYTES} bytes"
                    ));
                }
                if end.is_some() {
                    let text = String::from_utf8_lossy(line).into_owned();
                    let digits = text.split(';').next().unwrap_or_default().trim();
                    let left = u64::from_str_radix(digits, 16)
                        .map_err(|_| format!("expected a chunk's size, found \"{digits}\""))?;
                    *self = if left == 0 { Self::End } else { Self::Data { left } };
                }
            }
            Self::Data { left } => {
                take_up_to(left, bytes, out);
                if *left == 0 {
                    *self = Self::LineEnd;
                }
            }
            Self::LineEnd => {
                let (first, rest) = bytes.split_first().unwrap_or((&b'\n', &[]));
                *bytes = rest;
                match first {
                    b'\r' => {}
                    b'\n' => *self = Self::Size(Vec::new()),
                    _ => return Err("expected a line end after a chunk, found other bytes".to_owned()),
                }
            }
            Self::End => {}
        }
        Ok(())
    }
}

fn take_up_to(left: &mut u64, bytes: &mut &[u8], out: &mut Vec<u8>) {
    let count = bytes.len().min(usize::try_from(*left).unwrap_or(usize::MAX));
    out.extend_from_slice(&bytes[..count]);
    *bytes = &bytes[count..];
    *left -= count as u64;
}

/// Result of a read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Progress {
    /// More data may follow.
    More,
    /// No data until the deadline.
    Late,
    /// The body is complete.
    End,
}

/// A body being read.
pub(super) struct Body {
    stream: TcpStream,
    framing: Framing,
    /// Bytes of the body that were received with the head, without framing, until they are returned.
    first: Vec<u8>,
}

impl Body {
    /// Creates a body whose first bytes were received with the head.
    pub(super) fn new(stream: TcpStream, bytes: Vec<u8>, mut framing: Framing) -> Result<Self, String> {
        let mut first = Vec::new();
        framing.unframe(&bytes, &mut first)?;
        Ok(Self { stream, framing, first })
    }

    /// Waits for bytes until the deadline and appends them to `out`. Without a deadline, only available bytes are
    /// appended.
    ///
    /// # Errors
    /// Text that describes the error of the connection or the framing.
    pub(super) fn read(&mut self, out: &mut Vec<u8>, deadline: Option<Instant>) -> Result<Progress, String> {
        if !self.first.is_empty() {
            out.append(&mut self.first);
            return Ok(Progress::More);
        }
        if self.framing.has_ended() {
            return Ok(Progress::End);
        }
        match deadline.map(time_left) {
            Some(None) => return Ok(Progress::Late),
            Some(left) => self.stream.set_nonblocking(false).and_then(|()| self.stream.set_read_timeout(left)),
            None => self.stream.set_nonblocking(true),
        }
        .map_err(in_words)?;
        let mut piece = [0; PIECE_BYTES];
        match self.stream.read(&mut piece) {
            Ok(0) if matches!(self.framing, Framing::UntilClose) => Ok(Progress::End),
            Ok(0) => Err("the connection was closed within the response".to_owned()),
            Ok(count) => self.framing.unframe(&piece[..count], out).map(|()| Progress::More),
            Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => Ok(Progress::Late),
            Err(error) if error.kind() == ErrorKind::Interrupted => Ok(Progress::More),
            Err(error) => Err(in_words(error)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn unframed(mut framing: Framing, bytes: &[u8], piece: usize) -> Result<(Vec<u8>, bool), String> {
        let mut out = Vec::new();
        for piece in bytes.chunks(piece) {
            framing.unframe(piece, &mut out)?;
        }
        Ok((out, framing.has_ended()))
    }

    #[test]
    fn chunks_are_joined_in_any_pieces() {
        let bytes = b"5\r\nhello\r\nA;name=x\r\n, world-ab\r\n0\r\n\r\n";
        for piece in 1..bytes.len() {
            assert_eq!(unframed(Framing::chunked(), bytes, piece), Ok((b"hello, world-ab".to_vec(), true)));
        }
        assert!(unframed(Framing::chunked(), b"zz\r\n", 9).unwrap_err().contains("\"zz\""));
        assert!(unframed(Framing::chunked(), b"1\r\nab", 9).unwrap_err().contains("line end"));
        assert!(unframed(Framing::chunked(), &[b'1'; 2000], 64).unwrap_err().contains("1024"));
        assert!(unframed(Framing::chunked(), b"fffffffffffffffff\r\n", 64).is_err());
    }

    #[test]
    fn a_length_ends_the_body() {
        assert_eq!(unframed(Framing::Length { left: 3 }, b"abcdef", 2), Ok((b"abc".to_vec(), true)));
        assert_eq!(unframed(Framing::UntilClose, b"abcdef", 4), Ok((b"abcdef".to_vec(), false)));
    }
}
