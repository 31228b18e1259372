//! The server: this computer only, one port, one project at a time; hyper reads and writes the connections.
//!
//! ```text
//! TcpStream ─ hyper (head bounded, timed) ─ admit (length, Guard) ─ body (bounded, timed) ─ routes, on a thread ─ hyper
//! ```
//!
//! One thread reads and writes all connections. Requests read files and compute, so they are answered on threads of the
//! runtime's pool.

use std::io;
use std::net::{Ipv4Addr, TcpListener};
use std::sync::Arc;
use std::time::{Duration, Instant};

use http_body_util::{BodyExt, Full};
use hyper::body::{Body, Bytes, Incoming};
use hyper::http::request::Parts;
use hyper::server::conn::http1;
use hyper::service::service_fn;
use hyper_util::rt::{TokioIo, TokioTimer};
use tokio::net::TcpStream;
use tokio::sync::Semaphore;
use tokio::time::timeout;
use tokio_io_timeout::TimeoutStream;

use crate::desk::{Desk, Start};
use crate::error::{Error, Result};
use crate::guard::Guard;
use crate::http::{Head, Request, Response};
use crate::routes;
use crate::session::Session;

/// Interval of the checks whether to stop.
const POLL_INTERVAL: Duration = Duration::from_millis(100);
/// Maximum silence of a connection, in either direction, before it is closed.
const MAX_WAIT: Duration = Duration::from_secs(30);
/// Maximum time for which the body of a rejected request is read and discarded: closing a connection with unread bytes
/// resets it, and the response may be lost.
const CLOSE_TIMEOUT: Duration = Duration::from_secs(2);
/// Maximum size of a request's head; browsers send smaller ones.
const MAX_HEAD_BYTES: usize = 16 << 10;
const MAX_HEADERS: usize = 64;
/// Maximum number of connections, and of requests answered at a time; the page needs fewer.
const MAX_CONNECTIONS: usize = 64;
/// Maximum time without a free descriptor while no connection is open. Chosen by hand.
const MAX_LACK: Duration = Duration::from_secs(3);

/// A bound port and the service behind it.
pub struct Server {
    listener: TcpListener,
    port: u16,
    patience: Duration,
    service: Service,
}

/// The guard and the state for answering requests.
#[derive(Clone)]
struct Service {
    guard: Arc<Guard>,
    desk: Arc<Desk>,
}

impl Server {
    /// Binds a port of 127.0.0.1; 0 for any free port.
    ///
    /// # Errors
    /// The port is taken, or there are no random bytes for the token.
    pub fn bind(session: Session, port: u16) -> Result<Self> {
        let token = session.token().map(str::to_owned);
        Self::bind_desk(Desk::of_session(session), port, token.as_deref())
    }

    /// Like [`bind`](Self::bind), for a page on which a project is chosen; `token` is an existing token, if any.
    ///
    /// # Errors
    /// The port is taken, or there are no random bytes for the token.
    pub fn bind_start(start: Start, port: u16, token: Option<&str>) -> Result<Self> {
        Self::bind_desk(Desk::of_start(start), port, token)
    }

    fn bind_desk(desk: Desk, port: u16, token: Option<&str>) -> Result<Self> {
        let failed = |source| Error::Port { port, source };
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port)).map_err(failed)?;
        let port = listener.local_addr().map_err(failed)?.port();
        let service = Service { guard: Arc::new(Guard::new(port, token)?), desk: Arc::new(desk) };
        Ok(Self { listener, port, patience: MAX_WAIT, service })
    }

    /// Sets the silence after which connections are closed; the default is half a minute.
    pub fn with_patience(mut self, patience: Duration) -> Self {
        self.patience = patience;
        self
    }

    /// The address that opens the page; it contains the token, so it gives access.
    pub fn url(&self) -> String {
        self.service.guard.url()
    }

    /// Serves requests until `stop` returns true.
    ///
    /// # Errors
    /// The port failed.
    pub fn run(self, stop: impl Fn() -> bool + Send + 'static) -> Result<()> {
        let port = self.port;
        let failed = |source| Error::Port { port, source };
        let mut builder = tokio::runtime::Builder::new_current_thread();
        let runtime = builder.enable_all().max_blocking_threads(MAX_CONNECTIONS).build().map_err(failed)?;
        let outcome = runtime.block_on(self.accept(stop)).map_err(failed);
        // Running computations are not waited for.
        runtime.shutdown_background();
        outcome
    }

    async fn accept(self, stop: impl Fn() -> bool) -> io::Result<()> {
        self.listener.set_nonblocking(true)?;
        let listener = tokio::net::TcpListener::from_std(self.listener)?;
        let connections = Arc::new(Semaphore::new(MAX_CONNECTIONS));
        let mut lack_since = None;
        while !stop() {
            let Ok(accepted) = timeout(POLL_INTERVAL, listener.accept()).await else { continue };
            let stream = match accepted {
                Ok((stream, _)) => stream,
                // A connection that broke before it was accepted must not end the server.
                Err(error) if error.kind() == io::ErrorKind::ConnectionAborted => continue,
                // Open connections release descriptors when they close. If no connection is open, a descriptor may
                // never become free.
                Err(error) if is_out_of_descriptors(&error) => {
                    let is_idle = connections.available_permits() == MAX_CONNECTIONS;
                    if is_idle && lack_since.get_or_insert_with(Instant::now).elapsed() > MAX_LACK {
                        return Err(error);
                    }
                    tokio::time::sleep(POLL_INTERVAL).await;
                    continue;
                }
                Err(error) => return Err(error),
            };
            lack_since = None;
            let Ok(permit) = Arc::clone(&connections).try_acquire_owned() else { continue };
            let (service, patience) = (self.service.clone(), self.patience);
            tokio::spawn(async move {
                serve(stream, service, patience).await;
                drop(permit);
            });
        }
        Ok(())
    }
}

/// Whether this process, or the whole machine, has as many files open as it may.
fn is_out_of_descriptors(error: &io::Error) -> bool {
    // EMFILE and ENFILE have no kinds of their own; the numbers are those of every Unix.
    const EMFILE: i32 = 24;
    const ENFILE: i32 = 23;
    cfg!(unix) && matches!(error.raw_os_error(), Some(EMFILE | ENFILE))
}

/// Answers the requests of one connection until either side closes it.
async fn serve(stream: TcpStream, service: Service, patience: Duration) {
    if stream.set_nodelay(true).is_err() {
        return;
    }
    // hyper limits the time of a head, `Service::answer` that of a body, and the write timeout that of a response.
    let mut stream = TimeoutStream::new(stream);
    stream.set_write_timeout(Some(patience));
    let connection = http1::Builder::new()
        .timer(TokioTimer::new())
        .header_read_timeout(patience)
        .max_headers(MAX_HEADERS)
        .max_header_size(MAX_HEAD_BYTES)
        .serve_connection(
            TokioIo::new(Box::pin(stream)),
            service_fn(move |request| service.clone().answer(request, patience)),
        );
    // A broken or invalid connection has ended; other connections are not affected.
    let _ = connection.await;
}

impl Service {
    /// Answers a request. A body that is incomplete or late is an error, which ends the connection.
    async fn answer(
        self,
        request: hyper::Request<Incoming>,
        patience: Duration,
    ) -> io::Result<hyper::Response<Full<Bytes>>> {
        let (parts, mut body) = request.into_parts();
        let head = match self.admit(&parts, &body) {
            Ok(head) => head,
            Err(mut refusal) => {
                let _ = timeout(CLOSE_TIMEOUT, async { while let Some(Ok(_)) = body.frame().await {} }).await;
                refusal.headers.push(("Connection", "close".into()));
                return Ok(with_policy(refusal).into_hyper());
            }
        };
        let is_page = head.path == "/";
        let request = Request { head, body: read_body(body, patience).await? };
        let desk = self.desk;
        // A panic fails only its own request; the message is in the terminal.
        let answered = tokio::task::spawn_blocking(move || routes::answer(&desk, &request)).await;
        let mut response = answered.unwrap_or_else(|_| routes::broken());
        if is_page {
            response.headers.push(self.guard.cookie());
        }
        Ok(with_policy(response).into_hyper())
    }

    /// The head of an allowed request. No part of a body is stored before the sender is known to be the page.
    fn admit(&self, parts: &Parts, body: &Incoming) -> std::result::Result<Head, Response> {
        let head = Head::of(parts).ok_or_else(|| Response::plain(400, "expected an HTTP/1.1 request\n"))?;
        let Some(length) = body.size_hint().exact() else {
            return Err(Response::plain(411, "expected a body with Content-Length\n"));
        };
        self.guard.check(&head).map_err(|refusal| refusal.answer())?;
        if length > routes::max_body_bytes(&head.path) as u64 {
            return Err(Response::plain(413, "that is more than is taken here\n"));
        }
        Ok(head)
    }
}

/// Reads a body of known length, waiting at most `patience` for each piece.
async fn read_body(mut body: Incoming, patience: Duration) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    while let Some(frame) = timeout(patience, body.frame()).await? {
        if let Ok(piece) = frame.map_err(io::Error::other)?.into_data() {
            bytes.extend_from_slice(&piece);
        }
    }
    Ok(bytes)
}

/// Adds the security headers to a response.
fn with_policy(mut response: Response) -> Response {
    const POLICY: [(&str, &str); 5] = [
        (
            "Content-Security-Policy",
            "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob:; connect-src 'self'; \
             base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
        ),
        ("X-Content-Type-Options", "nosniff"),
        // The address contains the token.
        ("Referrer-Policy", "no-referrer"),
        ("Cache-Control", "no-store"),
        ("Cross-Origin-Resource-Policy", "same-origin"),
    ];
    response.headers.extend(POLICY.map(|(name, value)| (name, value.to_owned())));
    response
}
