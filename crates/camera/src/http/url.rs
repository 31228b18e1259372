//! `http://` addresses.

use std::fmt;
use std::str::FromStr;

use crate::error::CameraError;

/// An `http://` address, with user name and password if the camera requires them.
#[derive(Clone, PartialEq, Eq)]
pub struct Url {
    /// Host and port as in the `Host` header; port 80 is omitted.
    authority: String,
    host: String,
    port: u16,
    /// Path and query; begins with `/`.
    path: String,
    credentials: Option<Credentials>,
}

#[derive(Clone, PartialEq, Eq)]
struct Credentials {
    user: String,
    password: String,
}

impl Url {
    /// The host name or address; an IPv6 address without brackets.
    pub(crate) fn host(&self) -> &str {
        &self.host
    }

    pub(crate) fn port(&self) -> u16 {
        self.port
    }

    pub(crate) fn authority(&self) -> &str {
        &self.authority
    }

    pub(crate) fn path(&self) -> &str {
        &self.path
    }

    /// User name and password.
    pub(crate) fn credentials(&self) -> Option<(&str, &str)> {
        self.credentials.as_ref().map(|Credentials { user, password }| (user.as_str(), password.as_str()))
    }

    /// The target of a redirect. User name and password of this address are sent only to the same host and port.
    ///
    /// # Errors
    /// Text that says why the target is not followed.
    pub(crate) fn redirected(&self, location: &str) -> Result<Self, String> {
        let target = match location {
            rest if rest.starts_with("//") => format!("http:{rest}"),
            path if path.starts_with('/') => format!("http://{}{path}", self.authority),
            whole if whole.contains("://") => whole.to_owned(),
            relative => {
                let folder =
                    self.path.split('?').next().and_then(|path| path.rsplit_once('/')).map_or("", |(folder, _)| folder);
                format!("http://{}{folder}/{relative}", self.authority)
            }
        };
        let mut url: Self = target.parse().map_err(|error| format!("a redirect that is not followed: {error}"))?;
        if url.authority == self.authority && url.credentials.is_none() {
            url.credentials = self.credentials.clone();
        }
        Ok(url)
    }
}

impl FromStr for Url {
    type Err = CameraError;

    fn from_str(text: &str) -> Result<Self, CameraError> {
        let refused =
            |expected: &str| CameraError::Address { expected: expected.into(), found: without_password(text) };
        let rest = text.strip_prefix("http://").ok_or_else(|| refused("an address that begins with http://"))?;
        // Characters that could end the request line early are rejected.
        if text.chars().any(|character| character.is_ascii_control() || character == ' ') {
            return Err(refused("an address without blanks (write %20)"));
        }
        let rest = rest.split('#').next().unwrap_or_default();
        let (authority, path) = rest.split_at(rest.find(['/', '?']).unwrap_or(rest.len()));
        let (credentials, authority) = match authority.rsplit_once('@') {
            Some((credentials, authority)) => {
                let (user, password) = credentials.split_once(':').unwrap_or((credentials, ""));
                let decoded = |text| percent_decoded(text).ok_or_else(|| refused("%XX with two hexadecimal digits"));
                (Some(Credentials { user: decoded(user)?, password: decoded(password)? }), authority)
            }
            None => (None, authority),
        };
        let bracketed = authority.strip_prefix('[').and_then(|rest| rest.split_once(']'));
        let (host, port) = match bracketed {
            Some((host, rest)) => (host, rest.strip_prefix(':').or(rest.is_empty().then_some(""))),
            None => authority.split_once(':').map_or((authority, Some("")), |(host, port)| (host, Some(port))),
        };
        let port = match port {
            Some("") => Some(80),
            port => port.and_then(|port| port.parse::<u16>().ok()).filter(|port| *port != 0),
        };
        let port = port.ok_or_else(|| refused("http://HOST:PORT/PATH with a port of 1 to 65535"))?;
        if host.is_empty() {
            return Err(refused("http://HOST/PATH"));
        }
        let shown = if bracketed.is_some() { format!("[{host}]") } else { host.to_owned() };
        Ok(Self {
            authority: if port == 80 { shown } else { format!("{shown}:{port}") },
            host: host.to_owned(),
            port,
            path: if path.starts_with('/') { path.to_owned() } else { format!("/{path}") },
            credentials,
        })
    }
}

/// An address for messages, valid or not: with `***` for the text between `://USER:` and the last `@`.
pub fn without_password(address: &str) -> String {
    let parts = address.split_once("://").and_then(|(scheme, rest)| {
        let (credentials, host) = rest.rsplit_once('@')?;
        Some((scheme, credentials.split_once(':')?.0, host))
    });
    parts.map_or_else(|| address.to_owned(), |(scheme, user, host)| format!("{scheme}://{user}:***@{host}"))
}

fn percent_decoded(text: &str) -> Option<String> {
    let mut bytes = Vec::new();
    let mut rest = text.as_bytes();
    while let Some((&first, others)) = rest.split_first() {
        rest = others;
        if first == b'%' {
            let digits = std::str::from_utf8(rest.get(..2)?).ok()?;
            bytes.push(u8::from_str_radix(digits, 16).ok()?);
            rest = &rest[2..];
        } else {
            bytes.push(first);
        }
    }
    String::from_utf8(bytes).ok()
}

impl fmt::Display for Url {
    /// The address without the password.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("http://")?;
        if let Some(Credentials { user, .. }) = &self.credentials {
            write!(f, "{user}:***@")?;
        }
        write!(f, "{}{}", self.authority, self.path)
    }
}

impl fmt::Debug for Url {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{self}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn url(text: &str) -> Url {
        text.parse().unwrap()
    }

    #[test]
    fn parts_and_defaults() {
        let full = url("http://me:p%40ss:w@cam.local:8080/video?x=1#top");
        assert_eq!(
            (full.host(), full.port(), full.authority(), full.path()),
            ("cam.local", 8080, "cam.local:8080", "/video?x=1")
        );
        assert_eq!(full.credentials(), Some(("me", "p@ss:w")));
        assert_eq!(full.to_string(), "http://me:***@cam.local:8080/video?x=1", "the password stays here");
        assert!(!format!("{full:?}").contains("p@ss"));
        let short = url("http://10.0.0.7");
        assert_eq!((short.port(), short.authority(), short.path(), short.credentials()), (80, "10.0.0.7", "/", None));
        assert_eq!(url("http://cam?video").path(), "/?video");
        let v6 = url("http://[::1]:81/");
        assert_eq!((v6.host(), v6.port(), v6.authority()), ("::1", 81, "[::1]:81"));
    }

    #[test]
    fn nonsense_is_refused() {
        for text in [
            "http://",
            "http://:80/",
            "http://a:0/",
            "http://a:99999/",
            "http://a b/",
            "http://a/\r\nX: y",
            "http://[::1/",
        ] {
            assert!(text.parse::<Url>().is_err(), "{text}");
        }
        assert!("http://%zz@a/".parse::<Url>().is_err());
    }

    #[test]
    fn redirects_stay_with_http_and_passwords_with_their_host() {
        let from = url("http://me:secret@cam:8080/a/b?c");
        let to = |location: &str| from.redirected(location).unwrap();
        assert_eq!(to("/x").to_string(), "http://me:***@cam:8080/x");
        assert_eq!(to("x?y").to_string(), "http://me:***@cam:8080/a/x?y");
        assert_eq!(to("http://cam:8080/x").credentials(), Some(("me", "secret")));
        assert_eq!(to("http://other:8080/x").credentials(), None);
        assert_eq!(to("//other/x").to_string(), "http://other/x");
        let error = from.redirected("https://cam/x").unwrap_err();
        assert!(error.contains("not followed") && error.contains("https://cam/x"), "{error}");
    }
}
