//! Decides which requests are answered: those with the token, this server's host name and no foreign origin.
//!
//! Every program on this computer can reach the port, and every web page in the browser can make the browser send
//! requests to it. So each request must name this server (header `Host`), must not come from another page (`Origin`),
//! and must carry the token: in the printed address, in a cookie, or in the header `Authorization`. A foreign name that
//! resolves to this address is rejected.

use crate::error::{Error, Result};
use crate::http::{Head, Response};

/// Length of the token in bytes; its 128 bits cannot be guessed.
const TOKEN_BYTES: usize = 16;

/// The token and the server's own names, against which every request is checked.
#[derive(Debug, Clone)]
pub struct Guard {
    token: String,
    port: u16,
}

/// A random token of 32 hexadecimal digits.
///
/// # Errors
/// The operating system gives no random bytes.
pub fn new_token() -> Result<String> {
    let mut bytes = [0; TOKEN_BYTES];
    getrandom::fill(&mut bytes).map_err(Error::Random)?;
    Ok(bytes.iter().map(|byte| format!("{byte:02x}")).collect())
}

/// Why a request is rejected.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Refusal {
    /// Its Host header names another server.
    Host,
    /// It comes from another page.
    Origin,
    /// It has no token, or a wrong one.
    Token,
}

impl Refusal {
    /// The response to the client.
    pub fn answer(self) -> Response {
        match self {
            Self::Host => Response::plain(403, "this server answers to 127.0.0.1 and localhost only\n"),
            Self::Origin => Response::plain(403, "this server answers its own page only\n"),
            Self::Token => Response::plain(
                401,
                "open the address that was printed at the start: it contains the token of this page\n",
            ),
        }
    }
}

impl Guard {
    /// A guard with this token, or with a new one.
    ///
    /// # Errors
    /// The operating system gives no random bytes.
    pub fn new(port: u16, token: Option<&str>) -> Result<Self> {
        if let Some(token) = token {
            return Ok(Self { token: token.to_owned(), port });
        }
        Ok(Self { token: new_token()?, port })
    }

    /// The address that opens the page.
    pub fn url(&self) -> String {
        format!("http://127.0.0.1:{}/?token={}", self.port, self.token)
    }

    /// The cookie with the token. Cookies of a host are shared by all its ports, so the port is part of the name.
    /// Scripts cannot read the cookie, and requests from other sites do not carry it.
    pub fn cookie(&self) -> (&'static str, String) {
        ("Set-Cookie", format!("{}={}; Path=/; HttpOnly; SameSite=Strict", self.cookie_name(), self.token))
    }

    fn cookie_name(&self) -> String {
        format!("sdg-annotate-{}", self.port)
    }

    /// Accepts a request, or returns the reason for rejecting it.
    ///
    /// # Errors
    /// The first of [`Refusal`]'s reasons that applies.
    pub fn check(&self, head: &Head) -> std::result::Result<(), Refusal> {
        let names = [format!("127.0.0.1:{}", self.port), format!("localhost:{}", self.port)];
        let is_own = |name: &str| names.iter().any(|own| own == name);
        let mut hosts = head.all("host");
        if !(hosts.next().is_some_and(is_own) && hosts.next().is_none()) {
            return Err(Refusal::Host);
        }
        if !head.all("origin").all(|origin| origin.strip_prefix("http://").is_some_and(is_own)) {
            return Err(Refusal::Origin);
        }
        if self.carries_token(head) { Ok(()) } else { Err(Refusal::Token) }
    }

    fn carries_token(&self, head: &Head) -> bool {
        let name = self.cookie_name();
        let in_address = head.query.iter().flat_map(|q| q.split('&')).filter_map(|pair| pair.strip_prefix("token="));
        let in_cookies = head
            .all("cookie")
            .flat_map(|cookies| cookies.split(';'))
            .filter_map(|cookie| cookie.trim().strip_prefix(name.as_str())?.strip_prefix('='));
        let in_header = head.all("authorization").filter_map(|value| value.strip_prefix("Bearer "));
        in_address.chain(in_cookies).chain(in_header).any(|found| self.is_token(found))
    }

    /// Compares in constant time for tokens of the correct length.
    fn is_token(&self, found: &str) -> bool {
        found.len() == self.token.len()
            && found.bytes().zip(self.token.bytes()).fold(0, |differs, (a, b)| differs | (a ^ b)) == 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn guard() -> Guard {
        Guard { token: "secret".into(), port: 4000 }
    }

    fn check(uri: &str, headers: &[(&str, &str)]) -> std::result::Result<(), Refusal> {
        let query = uri.split_once('?').map(|(_, query)| query.to_owned());
        let headers = headers.iter().map(|&(name, value)| (name.to_owned(), value.to_owned())).collect();
        guard().check(&Head { query, headers, ..Head::default() })
    }

    const HERE: (&str, &str) = ("host", "127.0.0.1:4000");
    const COOKIE: (&str, &str) = ("cookie", "other=1; sdg-annotate-4000=secret");

    #[test]
    fn the_token_opens_in_address_cookie_and_header() {
        assert_eq!(check("/?token=secret", &[HERE]), Ok(()));
        assert_eq!(check("/api/session", &[HERE, COOKIE]), Ok(()));
        assert_eq!(check("/api/session", &[("host", "localhost:4000"), ("authorization", "Bearer secret")]), Ok(()));
    }

    #[test]
    fn without_it_or_with_another_the_door_stays_shut() {
        for uri in ["/", "/?token=", "/?token=secres", "/?token=secretsecret", "/?x=secret"] {
            assert_eq!(check(uri, &[HERE]), Err(Refusal::Token), "{uri}");
        }
        assert_eq!(check("/", &[HERE, ("cookie", "sdg-annotate-4001=secret")]), Err(Refusal::Token));
    }

    #[test]
    fn other_names_and_other_pages_are_refused_even_with_the_token() {
        for host in ["evil.example:4000", "127.0.0.1", "127.0.0.1:4001", "127.0.0.1:4000.evil.example"] {
            assert_eq!(check("/", &[("host", host), COOKIE]), Err(Refusal::Host), "{host}");
        }
        assert_eq!(check("/", &[COOKIE]), Err(Refusal::Host));
        assert_eq!(check("/", &[HERE, ("host", "evil.example"), COOKIE]), Err(Refusal::Host));
        for origin in ["http://evil.example", "null", "https://127.0.0.1:4000", "http://127.0.0.1:4001"] {
            assert_eq!(check("/", &[HERE, COOKIE, ("origin", origin)]), Err(Refusal::Origin), "{origin}");
        }
        assert_eq!(check("/", &[HERE, COOKIE, ("origin", "http://127.0.0.1:4000")]), Ok(()));
    }

    #[test]
    fn tokens_differ() {
        assert_ne!(Guard::new(1, None).unwrap().token, Guard::new(1, None).unwrap().token);
        assert_eq!(Guard::new(1, Some("kept")).unwrap().token, "kept");
    }
}
