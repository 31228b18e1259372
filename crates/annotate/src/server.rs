//! The server: this computer only, one port, one session, a thread for each connection.
//!
//! A browser keeps six connections at most, and what they ask for reads files and computes: threads do that more simply
//! than tasks would, and teaching has its own.

use std::io::Read;
use std::net::{Ipv4Addr, Shutdown, TcpListener, TcpStream};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use crate::error::{Error, Result};
use crate::guard::Guard;
use crate::http::{Head, Request, Response, Unreadable, read_body};
use crate::routes;
use crate::session::Session;

/// Between looks at whether to stop.
const LOOK_EVERY: Duration = Duration::from_millis(100);
/// A connection on which nothing comes for so long is closed.
const PATIENCE: Duration = Duration::from_secs(30);
/// How long what is refused is still read, so that the refusal arrives before the connection closes.
const LINGER: Duration = Duration::from_secs(2);
/// More connections than the page's browsers keep.
const MAX_CONNECTIONS: usize = 64;

/// A bound port and the session behind it.
pub struct Server {
    listener: TcpListener,
    guard: Guard,
    session: Arc<Session>,
    port: u16,
}

impl Server {
    /// Takes a port of 127.0.0.1; 0 for any that is free.
    ///
    /// # Errors
    /// A port that is taken, or no random bytes for the token.
    pub fn bind(session: Session, port: u16) -> Result<Self> {
        let failed = |source| Error::Port { port, source };
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port)).map_err(failed)?;
        let port = listener.local_addr().map_err(failed)?.port();
        Ok(Self { listener, guard: Guard::new(port, session.token())?, session: Arc::new(session), port })
    }

    /// The address that opens the page; it holds the token, so it gives access.
    pub fn url(&self) -> String {
        self.guard.url()
    }

    /// Answers until `stop` says so.
    ///
    /// # Errors
    /// The port failed.
    pub fn run(self, stop: impl Fn() -> bool + Send + 'static) -> Result<()> {
        let Self { listener, guard, session, port } = self;
        let guard = Arc::new(guard);
        let stopped = Arc::new(AtomicBool::new(false));
        let stopping = Arc::clone(&stopped);
        std::thread::spawn(move || {
            while !stop() {
                std::thread::sleep(LOOK_EVERY);
            }
            stopping.store(true, Ordering::SeqCst);
            // Wakes the server, which waits for a connection.
            let _ = TcpStream::connect((Ipv4Addr::LOCALHOST, port));
        });
        let connections = Arc::new(AtomicUsize::new(0));
        loop {
            let accepted = listener.accept();
            if stopped.load(Ordering::SeqCst) {
                return Ok(());
            }
            let (stream, _) = match accepted {
                Ok(accepted) => accepted,
                // One connection that broke before it was taken is no reason to close the page.
                Err(error) if error.kind() == std::io::ErrorKind::ConnectionAborted => continue,
                Err(source) => return Err(Error::Port { port, source }),
            };
            if connections.fetch_add(1, Ordering::SeqCst) >= MAX_CONNECTIONS {
                connections.fetch_sub(1, Ordering::SeqCst);
                continue;
            }
            let (guard, session, connections) = (Arc::clone(&guard), Arc::clone(&session), Arc::clone(&connections));
            std::thread::spawn(move || {
                serve(stream, &guard, &session);
                connections.fetch_sub(1, Ordering::SeqCst);
            });
        }
    }
}

/// Answers the requests of one connection, until either side has enough.
fn serve(mut stream: TcpStream, guard: &Guard, session: &Session) {
    let ready = stream
        .set_nodelay(true)
        .and_then(|()| stream.set_read_timeout(Some(PATIENCE)))
        .and_then(|()| stream.set_write_timeout(Some(PATIENCE)));
    let mut buffer = Vec::new();
    while ready.is_ok() {
        let (response, keeps_open) = match next_answer(&mut stream, &mut buffer, guard, session) {
            Ok(answer) => answer,
            Err(Unreadable::Closed) => return,
            Err(Unreadable::Refused(status, why)) => (with_policy(Response::plain(status, why)), false),
        };
        if response.write(&mut stream, keeps_open).is_err() {
            return;
        }
        if !keeps_open {
            return linger(&mut stream);
        }
    }
}

/// Reads a request and answers it, and says whether the connection stays. Nothing of a body is read before its sender is
/// known to be the page.
fn next_answer(
    stream: &mut TcpStream,
    buffer: &mut Vec<u8>,
    guard: &Guard,
    session: &Session,
) -> std::result::Result<(Response, bool), Unreadable> {
    let head = Head::read(stream, buffer)?;
    if let Err(refusal) = guard.check(&head) {
        return Ok((with_policy(refusal.answer()), false));
    }
    let body = read_body(stream, buffer, &head, routes::max_body_bytes(&head.path))?;
    let (keeps_open, is_page) = (head.keeps_open, head.path == "/");
    let request = Request { head, body };
    // What breaks in one request is told to the page, and the terminal has said more.
    let answered = catch_unwind(AssertUnwindSafe(|| routes::answer(session, &request)));
    let mut response = answered.unwrap_or_else(|_| routes::broken());
    if is_page {
        response.headers.push(guard.cookie());
    }
    Ok((with_policy(response), keeps_open))
}

/// Puts on an answer what browsers should know of it.
fn with_policy(mut response: Response) -> Response {
    const POLICY: [(&str, &str); 5] = [
        (
            "Content-Security-Policy",
            "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob:; connect-src 'self'; \
             base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
        ),
        ("X-Content-Type-Options", "nosniff"),
        // The address has the token.
        ("Referrer-Policy", "no-referrer"),
        ("Cache-Control", "no-store"),
        ("Cross-Origin-Resource-Policy", "same-origin"),
    ];
    response.headers.extend(POLICY.map(|(name, value)| (name, value.to_owned())));
    response
}

/// Closes so that the answer arrives: a connection closed on unread bytes is reset, and the answer may be lost.
fn linger(stream: &mut TcpStream) {
    if stream.shutdown(Shutdown::Write).is_err() || stream.set_read_timeout(Some(LINGER)).is_err() {
        return;
    }
    let start = Instant::now();
    let mut piece = [0; 1 << 14];
    while start.elapsed() < LINGER && stream.read(&mut piece).is_ok_and(|count| count > 0) {}
}
