//! Requests and responses of the routes, independent of hyper's types.
//!
//! Deliberately absent: reading and writing (server.rs), upgrades, trailers, compression, TLS.

use std::borrow::Cow;

use http_body_util::Full;
use hyper::StatusCode;
use hyper::body::Bytes;
use hyper::header::{CONTENT_TYPE, HeaderValue};
use hyper::http::request::Parts;

/// Request line and headers.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Head {
    /// `GET`, `PUT` …
    pub method: String,
    /// The path, as sent.
    pub path: String,
    /// The part after the question mark.
    pub query: Option<String>,
    /// Names in lower case, in the order sent.
    pub headers: Vec<(String, String)>,
}

/// A complete request.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Request {
    /// Request line and headers.
    pub head: Head,
    /// The body's bytes.
    pub body: Vec<u8>,
}

impl Head {
    /// The head of a request; `None` if a header is not UTF-8.
    pub fn of(parts: &Parts) -> Option<Self> {
        let text = |value: &HeaderValue| Some(std::str::from_utf8(value.as_bytes()).ok()?.to_owned());
        let headers = parts.headers.iter().map(|(name, value)| Some((name.as_str().to_owned(), text(value)?)));
        Some(Self {
            method: parts.method.as_str().to_owned(),
            path: parts.uri.path().to_owned(),
            query: parts.uri.query().map(str::to_owned),
            headers: headers.collect::<Option<_>>()?,
        })
    }

    /// All values of a header; `name` is in lower case.
    pub fn all<'a>(&'a self, name: &'a str) -> impl Iterator<Item = &'a str> {
        self.headers.iter().filter(move |(known, _)| known == name).map(|(_, value)| value.as_str())
    }

    /// The percent-decoded value of `name` in the query.
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
    /// A plain-text response.
    pub fn plain(status: u16, text: &'static str) -> Self {
        Self::new(status, "text/plain; charset=utf-8", text.as_bytes())
    }

    /// A response without further headers.
    pub fn new(status: u16, media_type: &'static str, body: impl Into<Cow<'static, [u8]>>) -> Self {
        Self { status, media_type, body: body.into(), headers: Vec::new() }
    }

    /// Converts to hyper's type. An invalid header, which none of our responses has, gives an internal error.
    pub fn into_hyper(self) -> hyper::Response<Full<Bytes>> {
        let body = match self.body {
            Cow::Borrowed(bytes) => Bytes::from_static(bytes),
            Cow::Owned(bytes) => Bytes::from(bytes),
        };
        let mut answer = hyper::Response::builder().status(self.status).header(CONTENT_TYPE, self.media_type);
        for (name, value) in self.headers {
            answer = answer.header(name, value);
        }
        answer.body(Full::new(body)).unwrap_or_else(|_| {
            let mut broken = hyper::Response::new(Full::default());
            *broken.status_mut() = StatusCode::INTERNAL_SERVER_ERROR;
            broken
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_request_is_taken_apart() {
        let request = hyper::Request::put("/api/x?name=a%20b").header("Host", "h").header("Cookie", "a");
        let (parts, ()) = request.header("COOKIE", "b").body(()).unwrap().into_parts();
        let head = Head::of(&parts).unwrap();
        assert_eq!((head.method.as_str(), head.path.as_str()), ("PUT", "/api/x"));
        assert_eq!(head.all("cookie").collect::<Vec<_>>(), ["a", "b"]);
        assert_eq!(head.query_value("name").unwrap(), "a b");
        let (parts, ()) = hyper::Request::get("/").header("Host", &b"\xff"[..]).body(()).unwrap().into_parts();
        assert_eq!(Head::of(&parts), None);
    }

    #[test]
    fn query_values_are_unescaped() {
        let value = |query: &str, name: &str| Head { query: Some(query.into()), ..Head::default() }.query_value(name);
        assert_eq!(value("a=1&name=my%20part%2f%C3%A4.png", "name").unwrap(), "my part/ä.png");
        assert_eq!(value("name=50%", "name").unwrap(), "50%");
        assert_eq!(value("names=3", "name"), None);
        assert_eq!(Head::default().query_value("name"), None);
    }
}
