//! The parts of a `multipart/x-mixed-replace` body.

use super::exchange::{MAX_HEAD_BYTES, MAX_HEADERS};
use crate::decode::MAX_ENCODED_BYTES;

/// Splits a body at its boundaries.
///
/// The variants of different cameras are accepted: the boundary is announced with or without its leading dashes, lines
/// end with CRLF or LF, and a part states its length or ends at the next boundary.
#[derive(Debug)]
pub(super) struct Multipart {
    /// `--` and the boundary.
    delimiter: Vec<u8>,
    buffer: Vec<u8>,
    /// Position up to which the buffer was searched for the delimiter.
    searched: usize,
    state: State,
}

#[derive(Debug, Clone, Copy)]
enum State {
    /// Before a boundary.
    Boundary,
    /// Between a boundary and its part.
    Head,
    /// In a part of known length.
    Sized(usize),
    /// In a part that ends at the next boundary.
    Unsized,
}

impl Multipart {
    /// A parser for bodies of this content type.
    ///
    /// # Errors
    /// Text that says that the content type has no boundary.
    pub(super) fn new(content_type: &str) -> Result<Self, String> {
        let parameters = content_type.split(';').skip(1).filter_map(|parameter| parameter.trim().split_once('='));
        let boundary = parameters.into_iter().find(|(name, _)| name.trim().eq_ignore_ascii_case("boundary"));
        let boundary =
            boundary.map(|(_, value)| value.trim().trim_matches('"').trim_start_matches('-')).unwrap_or_default();
        if boundary.is_empty() {
            return Err(format!("expected multipart with a boundary, found \"{content_type}\""));
        }
        let delimiter = [b"--", boundary.as_bytes()].concat();
        Ok(Self { delimiter, buffer: Vec::new(), searched: 0, state: State::Boundary })
    }

    /// The buffer to append data to.
    pub(super) fn buffer(&mut self) -> &mut Vec<u8> {
        &mut self.buffer
    }

    /// Whether a part has begun and is incomplete.
    pub(super) fn is_in_part(&self) -> bool {
        matches!(self.state, State::Sized(_) | State::Unsized)
    }

    /// The next complete part, without its head; `None` if more data is needed.
    ///
    /// # Errors
    /// Text that describes the malformed data. Data after it cannot be read.
    pub(super) fn next_part(&mut self) -> Result<Option<Vec<u8>>, String> {
        loop {
            match self.state {
                State::Boundary => {
                    let Some(at) = self.find_delimiter() else {
                        // Discards the searched bytes, except for the beginning of a delimiter.
                        self.buffer.drain(..self.searched);
                        self.searched = 0;
                        return Ok(None);
                    };
                    self.buffer.drain(..at + self.delimiter.len());
                    (self.searched, self.state) = (0, State::Head);
                }
                State::Head => {
                    let Some((head, length)) = PartHead::read(&self.buffer)? else {
                        if self.buffer.len() > MAX_HEAD_BYTES {
                            return Err(format!(
                                "expected a part's head of at most {MAX_HEAD_BYTES} bytes, found more"
                            ));
                        }
                        return Ok(None);
                    };
                    self.buffer.drain(..length);
                    self.state = head.length.map_or(State::Unsized, State::Sized);
                }
                State::Sized(length) => {
                    if self.buffer.len() < length {
                        return Ok(None);
                    }
                    let rest = self.buffer.split_off(length);
                    self.state = State::Boundary;
                    return Ok(Some(std::mem::replace(&mut self.buffer, rest)));
                }
                State::Unsized => {
                    let Some(at) = self.find_delimiter() else {
                        if self.buffer.len() > MAX_ENCODED_BYTES {
                            return Err(format!("expected a part of at most {MAX_ENCODED_BYTES} bytes, found more"));
                        }
                        return Ok(None);
                    };
                    let rest = self.buffer.split_off(at);
                    (self.searched, self.state) = (0, State::Boundary);
                    return Ok(Some(std::mem::replace(&mut self.buffer, rest)));
                }
            }
        }
    }

    fn find_delimiter(&mut self) -> Option<usize> {
        let last = (self.buffer.len() + 1).saturating_sub(self.delimiter.len());
        let starts = |at: &usize| self.buffer[*at] == b'-' && self.buffer[*at..].starts_with(&self.delimiter);
        let found = (self.searched..last).find(starts);
        if found.is_none() {
            self.searched = last.max(self.searched);
        }
        found
    }
}

struct PartHead {
    length: Option<usize>,
}

impl PartHead {
    /// The head after a boundary, and its length including the empty line; `None` if it is incomplete.
    fn read(bytes: &[u8]) -> Result<Option<(Self, usize)>, String> {
        // The remainder of the boundary's line: empty, or `--` after the last part.
        let Some(line_end) = bytes.iter().position(|&byte| byte == b'\n') else {
            return Ok(None);
        };
        let mut headers = [httparse::EMPTY_HEADER; MAX_HEADERS];
        let rest = &bytes[line_end + 1..];
        let parsed = httparse::parse_headers(rest, &mut headers);
        match parsed.map_err(|error| format!("expected a part's headers, found {error}"))? {
            httparse::Status::Partial => Ok(None),
            httparse::Status::Complete((length, headers)) => {
                let told = headers.iter().find(|header| header.name.eq_ignore_ascii_case("content-length"));
                let told = told.map(|header| String::from_utf8_lossy(header.value).trim().to_owned());
                let bounded = |text: String| {
                    let number = text.parse().ok().filter(|length| *length <= MAX_ENCODED_BYTES);
                    number.ok_or_else(|| {
                        format!("expected a part of at most {MAX_ENCODED_BYTES} bytes, found \"{text}\"")
                    })
                };
                Ok(Some((Self { length: told.map(bounded).transpose()? }, line_end + 1 + length)))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parts(content_type: &str, body: &[u8], piece: usize) -> Result<Vec<Vec<u8>>, String> {
        let mut multipart = Multipart::new(content_type)?;
        let mut found = Vec::new();
        for piece in body.chunks(piece) {
            multipart.buffer().extend_from_slice(piece);
            while let Some(part) = multipart.next_part()? {
                found.push(part);
            }
        }
        Ok(found)
    }

    #[test]
    fn parts_with_and_without_length_in_any_pieces() {
        let body = b"preamble\r\n--xy\r\nContent-Type: image/jpeg\r\nContent-Length: 6\r\n\r\nab--xy\r\n--xy\r\n\r\ncd\r\n--xy\n\
                     content-length:2\n\nef\n--xy--\r\n";
        for piece in 1..body.len() {
            let expected = [b"ab--xy".to_vec(), b"cd\r\n".to_vec(), b"ef".to_vec()];
            assert_eq!(parts("multipart/x-mixed-replace; boundary=xy", body, piece).unwrap(), expected, "{piece}");
        }
    }

    #[test]
    fn boundaries_are_announced_in_many_ways() {
        for announced in ["boundary=xy", "boundary=--xy", "BOUNDARY=\"xy\"", "a=b; boundary = --xy"] {
            for sent in ["--xy", "----xy"] {
                let body = format!("{sent}\r\n\r\nab{sent}\r\n");
                let found = parts(&format!("multipart/x-mixed-replace;{announced}"), body.as_bytes(), 3).unwrap();
                assert!(found.len() == 1 && found[0].starts_with(b"ab"), "{announced} {sent}");
            }
        }
        assert!(parts("multipart/x-mixed-replace", b"", 1).unwrap_err().contains("boundary"));
    }

    #[test]
    fn what_no_camera_sends_is_refused_and_not_kept() {
        let kind = "multipart/x-mixed-replace; boundary=xy";
        let refused = |body: &[u8]| parts(kind, body, 1 << 16).unwrap_err();
        assert!(refused(b"--xy\r\nContent-Length: 999999999999\r\n\r\n").contains("999999999999"));
        assert!(refused(b"--xy\r\nContent-Length: -1\r\n\r\n").contains("-1"));
        assert!(refused(&[b"--xy\r\nX: ".as_slice(), &vec![b'a'; 1 << 17]].concat()).contains("head of at most 16384"));
        assert!(
            refused(&[b"--xy\r\n\r\n".as_slice(), &vec![b'a'; MAX_ENCODED_BYTES + 9]].concat()).contains("33554432")
        );
        assert!(refused(b"--xy\r\n\xff\xd8\r\n\r\n").contains("headers"));
        let mut multipart = Multipart::new(kind).unwrap();
        for _ in 0..1000 {
            multipart.buffer().extend_from_slice(&[b'-'; 1000]);
            assert!(multipart.next_part().unwrap().is_none() && multipart.buffer.len() < 4);
        }
    }
}
