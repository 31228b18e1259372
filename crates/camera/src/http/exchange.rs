//! One request and the head of its response.

use std::io::{Read, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::time::Instant;

use http_auth::PasswordClient;

use super::body::{Body, Framing};
use super::url::Url;
use super::waiting::{in_words, time_left};

/// Maximum size of a response's head.
pub(super) const MAX_HEAD_BYTES: usize = 16 << 10;
/// Maximum number of headers.
pub(super) const MAX_HEADERS: usize = 64;
/// Maximum number of redirects.
const MAX_REDIRECTS: u32 = 5;

/// A response with status 200.
pub(super) struct Answer {
    pub(super) content_type: String,
    pub(super) body: Body,
}

/// The client's answer to the server's authentication challenge. It is kept between pictures, so that a picture usually
/// needs only one request.
#[derive(Default)]
pub(super) struct Login(Option<PasswordClient>);

/// Sends a request, authenticates if required, and follows redirects.
///
/// # Errors
/// Text that says why there is no response with a body.
pub(super) fn get(url: &Url, login: &mut Login, deadline: Instant) -> Result<Answer, String> {
    let mut url = url.clone();
    for _ in 0..=MAX_REDIRECTS {
        let known = login.authorization(&url).unwrap_or_default();
        let reply = match get_once(&url, known.as_deref(), deadline)? {
            // The server also sends challenges if the previous authentication is no longer valid.
            Reply::Challenges(challenges) => {
                login.challenged(&url, &challenges)?;
                get_once(&url, login.authorization(&url)?.as_deref(), deadline)?
            }
            reply => reply,
        };
        match reply {
            Reply::Answer(answer) => return Ok(answer),
            Reply::Redirect(location) => url = url.redirected(&location)?,
            Reply::Challenges(_) => {
                return Err("expected the camera's user and password, found status 401 for those of the address".into());
            }
        }
    }
    Err(format!("expected pictures, found more than {MAX_REDIRECTS} redirects, the last to {url}"))
}

enum Reply {
    Answer(Answer),
    Redirect(String),
    /// Status 401, with its authentication challenges.
    Challenges(Vec<String>),
}

impl Login {
    /// Prepares the answer to a server's challenge, digest or basic.
    fn challenged(&mut self, url: &Url, challenges: &[String]) -> Result<(), String> {
        if url.credentials().is_none() {
            return Err(
                "expected http://USER:PASSWORD@HOST/… with the camera's user and password, found status 401".to_owned()
            );
        }
        let builder =
            challenges.iter().fold(PasswordClient::builder(), |builder, challenge| builder.challenges(challenge));
        self.0 = Some(builder.build().map_err(unknown)?);
        Ok(())
    }

    /// The value of the Authorization header; `None` if the server has not requested it, or the address has no user.
    fn authorization(&mut self, url: &Url) -> Result<Option<String>, String> {
        let (Some(client), Some((username, password))) = (&mut self.0, url.credentials()) else { return Ok(None) };
        let params = http_auth::PasswordParams { username, password, uri: url.path(), method: "GET", body: Some(&[]) };
        client.respond(&params).map(Some).map_err(unknown)
    }
}

fn unknown(error: String) -> String {
    format!("expected a camera that asks for digest or basic authentication, found {error}")
}

fn get_once(url: &Url, authorization: Option<&str>, deadline: Instant) -> Result<Reply, String> {
    let mut stream = connect(url, deadline)?;
    let authorization = authorization.map_or_else(String::new, |value| format!("Authorization: {value}\r\n"));
    let request = format!(
        "GET {} HTTP/1.1\r\nHost: {}\r\n{authorization}User-Agent: sdg\r\nAccept: multipart/x-mixed-replace, image/jpeg, \
         image/png\r\nConnection: close\r\n\r\n",
        url.path(),
        url.authority()
    );
    let left = time_left(deadline).ok_or("no answer in time")?;
    stream.set_write_timeout(Some(left)).and_then(|()| stream.write_all(request.as_bytes())).map_err(in_words)?;

    let mut bytes = Vec::new();
    loop {
        if let Some((head, length)) = Head::read(&bytes)? {
            bytes.drain(..length);
            // Interim responses such as 100 Continue precede the final one.
            if (100..200).contains(&head.status) {
                continue;
            }
            return head.into_reply(stream, bytes);
        }
        if bytes.len() > MAX_HEAD_BYTES {
            return Err(format!("expected a head of at most {MAX_HEAD_BYTES} bytes, found more"));
        }
        let left = time_left(deadline).ok_or("expected an answer, found none in time")?;
        stream.set_read_timeout(Some(left)).map_err(in_words)?;
        let mut piece = [0; 4096];
        match stream.read(&mut piece).map_err(in_words)? {
            0 => return Err(format!("expected an answer, found the connection closed after {} bytes", bytes.len())),
            count => bytes.extend_from_slice(&piece[..count]),
        }
    }
}

fn connect(url: &Url, deadline: Instant) -> Result<TcpStream, String> {
    let addresses = (url.host(), url.port())
        .to_socket_addrs()
        .map_err(|error| format!("{} cannot be resolved: {error}", url.host()))?;
    let mut why = format!("{} has no IP address", url.host());
    for address in addresses {
        let left = time_left(deadline).ok_or("no connection in time")?;
        match TcpStream::connect_timeout(&address, left) {
            Ok(stream) => return Ok(stream),
            Err(error) => why = format!("no connection to {address}: {}", in_words(error)),
        }
    }
    Err(why)
}

/// The relevant fields of a response's head.
#[derive(Debug, Default, PartialEq, Eq)]
struct Head {
    status: u16,
    content_type: String,
    location: Option<String>,
    length: Option<String>,
    challenges: Vec<String>,
    is_chunked: bool,
}

impl Head {
    /// The head and its length; `None` while it is incomplete.
    fn read(bytes: &[u8]) -> Result<Option<(Self, usize)>, String> {
        let mut headers = [httparse::EMPTY_HEADER; MAX_HEADERS];
        let mut answer = httparse::Response::new(&mut headers);
        let parsed = answer.parse(bytes).map_err(|error| format!("expected an answer of HTTP/1.1, found {error}"))?;
        let httparse::Status::Complete(length) = parsed else {
            return Ok(None);
        };
        let mut head = Self { status: answer.code.unwrap_or_default(), ..Self::default() };
        for header in answer.headers.iter() {
            let value = String::from_utf8_lossy(header.value).trim().to_owned();
            match header.name.to_ascii_lowercase().as_str() {
                "content-type" => head.content_type = value,
                "location" => head.location = Some(value),
                "www-authenticate" => head.challenges.push(value),
                "content-length" => head.length = Some(value),
                "transfer-encoding" => head.is_chunked = value.to_ascii_lowercase().ends_with("chunked"),
                _ => {}
            }
        }
        Ok(Some((head, length)))
    }

    fn into_reply(self, stream: TcpStream, rest: Vec<u8>) -> Result<Reply, String> {
        match self.status {
            200 => {}
            301 | 302 | 303 | 307 | 308 => {
                return self
                    .location
                    .map(Reply::Redirect)
                    .ok_or_else(|| "expected a redirect's target, found none".to_owned());
            }
            401 => return Ok(Reply::Challenges(self.challenges)),
            other => return Err(format!("expected status 200, found {other}")),
        }
        let framing = match self.length {
            _ if self.is_chunked => Framing::chunked(),
            None => Framing::UntilClose,
            Some(length) => {
                let left =
                    length.parse().map_err(|_| format!("expected a number as Content-Length, found \"{length}\""))?;
                Framing::Length { left }
            }
        };
        Ok(Reply::Answer(Answer { content_type: self.content_type, body: Body::new(stream, rest, framing)? }))
    }
}
