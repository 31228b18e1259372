//! HTTP/1.1 as far as a browser on this computer needs it: requests with a length, read within bounds.
//!
//! ```text
//! TcpStream ─ Head::read (bounded, parsed by httparse) ─ read_body (bounded) ─ Request ─ … ─ Response::write ─ TcpStream
//! ```
//!
//! What is deliberately absent: bodies without a length, upgrades, trailers, compression, TLS. What is not understood is
//! refused, and the connection with it is closed.

use std::borrow::Cow;
use std::io::{self, Read, Write};

/// Longer heads than any browser sends to a page of ours.
const MAX_HEAD_BYTES: usize = 16 << 10;
const MAX_HEADERS: usize = 64;

/// Where a request goes and what it says of itself.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Head {
    /// `GET`, `PUT` …
    pub method: String,
    /// The path, as sent.
    pub path: String,
    /// What follows the question mark.
    pub query: Option<String>,
    /// Names in small letters, in the order sent.
    pub headers: Vec<(String, String)>,
    /// Whether another request may follow on the connection.
    pub keeps_open: bool,
    /// Bytes of the body.
    pub content_length: usize,
}

/// A request as it is answered.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Request {
    /// Request line and headers.
    pub head: Head,
    /// The body's bytes.
    pub body: Vec<u8>,
}

/// Why no request could be read.
#[derive(Debug)]
pub enum Unreadable {
    /// The other side closed the connection between requests, or was silent for too long.
    Closed,
    /// What came is no request that is understood here: status and one line.
    Refused(u16, &'static str),
}

impl From<io::Error> for Unreadable {
    fn from(_: io::Error) -> Self {
        Self::Closed
    }
}

impl Head {
    /// Reads one head. `buffer` keeps what came after it: the body's first bytes.
    ///
    /// # Errors
    /// A closed connection, or a head that is too long, malformed, or of a body whose length it does not tell.
    pub fn read(stream: &mut impl Read, buffer: &mut Vec<u8>) -> Result<Self, Unreadable> {
        let mut piece = [0; 4096];
        loop {
            if let Some((head, length)) = Self::parse(buffer)? {
                buffer.drain(..length);
                return Ok(head);
            }
            if buffer.len() > MAX_HEAD_BYTES {
                return Err(Unreadable::Refused(431, "expected a head of at most 16 KiB\n"));
            }
            match stream.read(&mut piece)? {
                0 => return Err(Unreadable::Closed),
                count => buffer.extend_from_slice(&piece[..count]),
            }
        }
    }

    /// The head at the start of `bytes` and its length, or `None` while it is incomplete.
    fn parse(bytes: &[u8]) -> Result<Option<(Self, usize)>, Unreadable> {
        const MALFORMED: Unreadable = Unreadable::Refused(400, "expected an HTTP/1.1 request\n");
        let mut headers = [httparse::EMPTY_HEADER; MAX_HEADERS];
        let mut request = httparse::Request::new(&mut headers);
        let httparse::Status::Complete(length) = request.parse(bytes).map_err(|_| MALFORMED)? else {
            return Ok(None);
        };
        let target = request.path.unwrap_or_default();
        let (path, query) = match target.split_once('?') {
            Some((path, query)) => (path, Some(query.to_owned())),
            None => (target, None),
        };
        let mut head = Self {
            method: request.method.unwrap_or_default().to_owned(),
            path: path.to_owned(),
            query,
            keeps_open: request.version == Some(1),
            ..Self::default()
        };
        for header in request.headers.iter() {
            let value = std::str::from_utf8(header.value).map_err(|_| MALFORMED)?;
            head.headers.push((header.name.to_ascii_lowercase(), value.trim().to_owned()));
        }
        if head.all("connection").any(|value| value.eq_ignore_ascii_case("close")) {
            head.keeps_open = false;
        }
        if head.all("transfer-encoding").next().is_some() {
            return Err(Unreadable::Refused(411, "expected a body with Content-Length\n"));
        }
        // Two lengths are two opinions on where the next request begins.
        let lengths: Vec<&str> = head.all("content-length").collect();
        head.content_length = match lengths[..] {
            [] => 0,
            [length] if length.bytes().all(|byte| byte.is_ascii_digit()) => length.parse().map_err(|_| MALFORMED)?,
            _ => return Err(MALFORMED),
        };
        Ok(Some((head, length)))
    }

    /// Every value of a header, whose name is given in small letters.
    pub fn all<'a>(&'a self, name: &'a str) -> impl Iterator<Item = &'a str> {
        self.headers.iter().filter(move |(known, _)| known == name).map(|(_, value)| value.as_str())
    }

    /// The value of `name` in the query, percent signs resolved.
    pub fn query_value(&self, name: &str) -> Option<String> {
        let raw = self.query.as_ref()?.split('&').find_map(|pair| pair.strip_prefix(name)?.strip_prefix('='))?;
        let mut bytes = Vec::with_capacity(raw.len());
        let mut rest = raw.as_bytes();
        while let [first, tail @ ..] = rest {
            let hex = tail.get(..2).and_then(|digits| std::str::from_utf8(digits).ok());
            match (first, hex.and_then(|digits| u8::from_str_radix(digits, 16).ok())) {
                (b'%', Some(byte)) => {
                    bytes.push(byte);
                    rest = &tail[2..];
                }
                _ => {
                    bytes.push(*first);
                    rest = tail;
                }
            }
        }
        Some(String::from_utf8_lossy(&bytes).into_owned())
    }
}

/// Reads the body that `head` announces, of which `buffer` may hold the start.
///
/// # Errors
/// A body longer than `most` bytes, or one that breaks off.
pub fn read_body(
    stream: &mut impl Read,
    buffer: &mut Vec<u8>,
    head: &Head,
    most: usize,
) -> Result<Vec<u8>, Unreadable> {
    if head.content_length > most {
        return Err(Unreadable::Refused(413, "that is more than is taken here\n"));
    }
    let mut body = buffer.drain(..head.content_length.min(buffer.len())).collect::<Vec<u8>>();
    let missing = head.content_length - body.len();
    stream.by_ref().take(missing as u64).read_to_end(&mut body)?;
    if body.len() < head.content_length { Err(Unreadable::Closed) } else { Ok(body) }
}

/// A response to the browser.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Response {
    /// 200, 404 …
    pub status: u16,
    /// The body's media type.
    pub media_type: &'static str,
    /// The body.
    pub body: Cow<'static, [u8]>,
    /// Further headers.
    pub headers: Vec<(&'static str, String)>,
}

impl Response {
    /// An answer of that status in plain words.
    pub fn plain(status: u16, text: &'static str) -> Self {
        Self::new(status, "text/plain; charset=utf-8", text.as_bytes())
    }

    /// A response without further headers.
    pub fn new(status: u16, media_type: &'static str, body: impl Into<Cow<'static, [u8]>>) -> Self {
        Self { status, media_type, body: body.into(), headers: Vec::new() }
    }

    /// Sends it.
    ///
    /// # Errors
    /// A connection that breaks.
    pub fn write(&self, stream: &mut impl Write, keeps_open: bool) -> io::Result<()> {
        let connection = if keeps_open { "keep-alive" } else { "close" };
        let mut head = format!(
            "HTTP/1.1 {} {}\r\nContent-Type: {}\r\nContent-Length: {}\r\nConnection: {connection}\r\n",
            self.status,
            reason(self.status),
            self.media_type,
            self.body.len()
        );
        for (name, value) in &self.headers {
            head += &format!("{name}: {value}\r\n");
        }
        head += "\r\n";
        stream.write_all(head.as_bytes())?;
        stream.write_all(&self.body)?;
        stream.flush()
    }
}

fn reason(status: u16) -> &'static str {
    match status {
        200 => "OK",
        400 => "Bad Request",
        401 => "Unauthorized",
        403 => "Forbidden",
        404 => "Not Found",
        409 => "Conflict",
        411 => "Length Required",
        413 => "Content Too Large",
        422 => "Unprocessable Content",
        431 => "Request Header Fields Too Large",
        503 => "Service Unavailable",
        _ => "Internal Server Error",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(bytes: &[u8]) -> Result<(Head, Vec<u8>), Unreadable> {
        let mut stream = bytes;
        let mut buffer = Vec::new();
        let head = Head::read(&mut stream, &mut buffer)?;
        let body = read_body(&mut stream, &mut buffer, &head, 100)?;
        Ok((head, body))
    }

    fn refusal(bytes: &[u8]) -> u16 {
        match read(bytes) {
            Err(Unreadable::Refused(status, _)) => status,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn a_request_is_taken_apart() {
        let (head, body) =
            read(b"PUT /api/x?name=a%20b HTTP/1.1\r\nHost: h\r\nCookie: a\r\nCOOKIE: b\r\nContent-Length: 2\r\n\r\nhi")
                .unwrap();
        assert_eq!((head.method.as_str(), head.path.as_str(), body.as_slice()), ("PUT", "/api/x", &b"hi"[..]));
        assert_eq!(head.all("cookie").collect::<Vec<_>>(), ["a", "b"]);
        assert_eq!(head.query_value("name").unwrap(), "a b");
        assert!(head.keeps_open);
        let (old, _) = read(b"GET / HTTP/1.0\r\n\r\n").unwrap();
        assert!(!old.keeps_open && old.query.is_none());
    }

    #[test]
    fn query_values_are_unescaped() {
        let value = |query: &str, name: &str| Head { query: Some(query.into()), ..Head::default() }.query_value(name);
        assert_eq!(value("a=1&name=my%20part%2f%C3%A4.png", "name").unwrap(), "my part/ä.png");
        assert_eq!(value("name=50%", "name").unwrap(), "50%");
        assert_eq!(value("names=3", "name"), None);
        assert_eq!(Head::default().query_value("name"), None);
    }

    #[test]
    fn what_is_not_understood_is_refused() {
        assert_eq!(refusal(b"\x16\x03\x01 a TLS greeting"), 400);
        assert_eq!(refusal(b"POST / HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\n"), 411);
        assert_eq!(refusal(b"POST / HTTP/1.1\r\nContent-Length: 1\r\nContent-Length: 2\r\n\r\n"), 400);
        assert_eq!(refusal(b"POST / HTTP/1.1\r\nContent-Length: +1\r\n\r\n"), 400);
        assert_eq!(refusal(b"POST / HTTP/1.1\r\nContent-Length: 99999999999999999999999\r\n\r\n"), 400);
        assert_eq!(refusal(b"POST / HTTP/1.1\r\nContent-Length: 101\r\n\r\n"), 413);
        let endless = [b"GET / HTTP/1.1\r\nX: ".to_vec(), vec![b'a'; 20 << 10]].concat();
        assert_eq!(refusal(&endless), 431);
    }

    #[test]
    fn a_connection_that_breaks_off_is_no_request() {
        for bytes in [&b""[..], b"GET / HT", b"POST / HTTP/1.1\r\nContent-Length: 5\r\n\r\nhi"] {
            assert!(matches!(read(bytes), Err(Unreadable::Closed)));
        }
    }

    #[test]
    fn requests_on_one_connection_are_kept_apart() {
        let mut stream = &b"POST /a HTTP/1.1\r\nContent-Length: 3\r\n\r\noneGET /b HTTP/1.1\r\n\r\n"[..];
        let mut buffer = Vec::new();
        let first = Head::read(&mut stream, &mut buffer).unwrap();
        assert_eq!(read_body(&mut stream, &mut buffer, &first, 10).unwrap(), b"one");
        assert_eq!(Head::read(&mut stream, &mut buffer).unwrap().path, "/b");
    }
}
