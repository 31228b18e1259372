//! Serves pictures as motion JPEG to browsers on this computer.

use std::io::{Read, Write};
use std::net::{Ipv4Addr, TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Condvar, Mutex, OnceLock, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use image::RgbImage;
use image::codecs::jpeg::JpegEncoder;

use crate::error::CameraError;

/// JPEG quality from 1 to 100; at 90, thin lines keep their colours.
const QUALITY: u8 = 90;
/// Time limit for a browser to read data before it is disconnected.
const WRITE_TIMEOUT: Duration = Duration::from_secs(5);
/// Time limit for each read of a request.
const REQUEST_TIMEOUT: Duration = Duration::from_secs(5);
/// Interval between checks whether the server ends, while there are no new pictures.
const POLL_INTERVAL: Duration = Duration::from_millis(200);
/// Time limit for browsers to receive the last picture at the end.
const LAST_PICTURE_WITHIN: Duration = Duration::from_millis(500);
/// Maximum number of connections; one user needs fewer.
const MAX_CONNECTIONS: usize = 32;
/// Maximum size of a request; browsers send less.
const MAX_REQUEST_BYTES: usize = 16 << 10;

const PAGE: &str = include_str!("page/index.html");
const SCRIPT: &str = include_str!("page/page.js");

/// A server on 127.0.0.1 that shows the published pictures to browsers, over at most 32 connections at a time.
///
/// | path | answer |
/// |---|---|
/// | `/` | a page with the live picture, which also shows that the program has ended |
/// | `/page.js` | the page's script |
/// | `/stream` | `multipart/x-mixed-replace`, a JPEG in each part |
/// | `/snapshot.jpg` | the newest picture; status 503 before the first |
/// | `/words` | the description of the newest picture; empty before the first |
///
/// [`publish`](Self::publish) never waits: a picture is encoded when the first browser requests it, and a slow browser
/// gets the newest picture when the browser is ready. Only requests to 127.0.0.1 or localhost with this port are
/// accepted, so foreign host names that resolve to this address are rejected. Requests from other pages are rejected,
/// too.
pub struct MjpegServer {
    shared: Arc<Shared>,
    port: u16,
    thread: Option<JoinHandle<()>>,
}

#[derive(Default)]
struct Shared {
    newest: Mutex<Option<Arc<Published>>>,
    changed: Condvar,
    is_stopped: AtomicBool,
    num_connections: AtomicUsize,
}

struct Published {
    number: u64,
    picture: RgbImage,
    /// Description of the picture for screen readers.
    words: String,
    /// The picture as JPEG, encoded on the first request.
    jpeg: OnceLock<Vec<u8>>,
}

impl Shared {
    fn newest(&self) -> Option<Arc<Published>> {
        self.newest.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

impl Published {
    fn jpeg(&self) -> &[u8] {
        self.jpeg.get_or_init(|| {
            let mut bytes = Vec::new();
            // A picture without pixels cannot be encoded as JPEG, and no browser could show it.
            let _ = JpegEncoder::new_with_quality(&mut bytes, QUALITY).encode_image(&self.picture);
            bytes
        })
    }
}

impl MjpegServer {
    /// Binds a port of 127.0.0.1; 0 for any free port.
    ///
    /// # Errors
    /// [`CameraError::Port`] if the port is taken.
    pub fn start(port: u16) -> Result<Self, CameraError> {
        let failed = |source| CameraError::Port { port, source };
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port)).map_err(failed)?;
        let port = listener.local_addr().map_err(failed)?.port();
        let shared = Arc::new(Shared::default());
        let serving = Arc::clone(&shared);
        let thread = std::thread::spawn(move || accept(&listener, port, &serving));
        Ok(Self { shared, port, thread: Some(thread) })
    }

    /// The address of the page.
    pub fn url(&self) -> String {
        format!("http://127.0.0.1:{}/", self.port)
    }

    /// Replaces the shown picture; `words` describes it to screen readers.
    pub fn publish(&self, picture: RgbImage, words: impl Into<String>) {
        let mut newest = self.shared.newest.lock().unwrap_or_else(PoisonError::into_inner);
        let number = newest.as_ref().map_or(0, |published| published.number + 1);
        *newest = Some(Arc::new(Published { number, picture, words: words.into(), jpeg: OnceLock::new() }));
        drop(newest);
        self.shared.changed.notify_all();
    }
}

impl Drop for MjpegServer {
    fn drop(&mut self) {
        self.shared.is_stopped.store(true, Ordering::SeqCst);
        self.shared.changed.notify_all();
        // Connecting wakes the thread that waits for connections.
        let _ = TcpStream::connect((Ipv4Addr::LOCALHOST, self.port));
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
        let stopped = Instant::now();
        while self.shared.num_connections.load(Ordering::SeqCst) > 0 && stopped.elapsed() < LAST_PICTURE_WITHIN {
            std::thread::sleep(Duration::from_millis(5));
        }
    }
}

fn accept(listener: &TcpListener, port: u16, shared: &Arc<Shared>) {
    for stream in listener.incoming() {
        if shared.is_stopped.load(Ordering::SeqCst) {
            return;
        }
        let Ok(stream) = stream else {
            // A connection was closed before it was accepted, or too many files are open: the next attempt may succeed.
            std::thread::sleep(Duration::from_millis(10));
            continue;
        };
        if shared.num_connections.fetch_add(1, Ordering::SeqCst) >= MAX_CONNECTIONS {
            shared.num_connections.fetch_sub(1, Ordering::SeqCst);
            continue;
        }
        let shared = Arc::clone(shared);
        std::thread::spawn(move || {
            // It is not an error if a browser disconnects.
            let _ = serve(stream, port, &shared);
            shared.num_connections.fetch_sub(1, Ordering::SeqCst);
        });
    }
}

fn serve(mut stream: TcpStream, port: u16, shared: &Shared) -> std::io::Result<()> {
    stream.set_nodelay(true)?;
    stream.set_read_timeout(Some(REQUEST_TIMEOUT))?;
    stream.set_write_timeout(Some(WRITE_TIMEOUT))?;
    match read_path(&mut stream, port)? {
        Err((status, why)) => respond(&mut stream, status, "text/plain; charset=utf-8", why.as_bytes()),
        Ok(path) => match path.as_str() {
            "/" => respond(&mut stream, "200 OK", "text/html; charset=utf-8", PAGE.as_bytes()),
            "/page.js" => respond(&mut stream, "200 OK", "text/javascript; charset=utf-8", SCRIPT.as_bytes()),
            "/stream" => stream_pictures(&mut stream, shared),
            "/words" => {
                let newest = shared.newest();
                let words = newest.as_ref().map_or("", |published| published.words.as_str());
                respond(&mut stream, "200 OK", "text/plain; charset=utf-8", words.as_bytes())
            }
            "/snapshot.jpg" => match shared.newest() {
                Some(published) => respond(&mut stream, "200 OK", "image/jpeg", published.jpeg()),
                None => respond(&mut stream, "503 Service Unavailable", "text/plain", b"there is no picture yet\n"),
            },
            _ => {
                respond(&mut stream, "404 Not Found", "text/plain", b"there are /, /stream, /snapshot.jpg and /words\n")
            }
        },
    }
}

/// The path of an allowed request, or a status and the reason.
type Asked = Result<String, (&'static str, &'static str)>;

fn read_path(stream: &mut TcpStream, port: u16) -> std::io::Result<Asked> {
    let mut bytes = Vec::new();
    loop {
        let mut headers = [httparse::EMPTY_HEADER; 64];
        let mut request = httparse::Request::new(&mut headers);
        match request.parse(&bytes) {
            Ok(httparse::Status::Complete(_)) => return Ok(judge(&request, port)),
            Ok(httparse::Status::Partial) if bytes.len() <= MAX_REQUEST_BYTES => {}
            _ => return Ok(Err(("400 Bad Request", "expected a request of HTTP/1.1\n"))),
        }
        let mut piece = [0; 4096];
        match stream.read(&mut piece)? {
            0 => return Err(std::io::ErrorKind::UnexpectedEof.into()),
            count => bytes.extend_from_slice(&piece[..count]),
        }
    }
}

fn judge(request: &httparse::Request<'_, '_>, port: u16) -> Asked {
    let values = |name: &'static str| {
        let named = request.headers.iter().filter(move |header| header.name.eq_ignore_ascii_case(name));
        named.map(|header| String::from_utf8_lossy(header.value).trim().to_owned())
    };
    let names = [format!("127.0.0.1:{port}"), format!("localhost:{port}")];
    let is_own = |name: &str| names.iter().any(|own| own == name);
    let mut hosts = values("host");
    if !(hosts.next().is_some_and(|host| is_own(&host)) && hosts.next().is_none()) {
        return Err(("403 Forbidden", "this server answers to 127.0.0.1 and localhost only\n"));
    }
    if !values("origin").all(|origin| origin.strip_prefix("http://").is_some_and(is_own)) {
        return Err(("403 Forbidden", "this server answers its own page only\n"));
    }
    if request.method != Some("GET") {
        return Err(("405 Method Not Allowed", "expected GET\n"));
    }
    Ok(request.path.unwrap_or_default().split('?').next().unwrap_or_default().to_owned())
}

/// The head of a response. Each response closes its connection, is not cached, and cannot be embedded in other pages.
fn head(status: &str, content_type: &str) -> String {
    format!(
        "HTTP/1.1 {status}\r\nContent-Type: {content_type}\r\nConnection: close\r\nCache-Control: no-store\r\n\
         X-Content-Type-Options: nosniff\r\nCross-Origin-Resource-Policy: same-origin\r\nContent-Security-Policy: default-src 'none'; \
         img-src 'self'; script-src 'self'; connect-src 'self'; style-src 'unsafe-inline'; frame-ancestors 'none'\r\n"
    )
}

fn respond(stream: &mut TcpStream, status: &str, content_type: &str, body: &[u8]) -> std::io::Result<()> {
    stream.write_all(format!("{}Content-Length: {}\r\n\r\n", head(status, content_type), body.len()).as_bytes())?;
    stream.write_all(body)?;
    stream.shutdown(std::net::Shutdown::Write)
}

fn stream_pictures(stream: &mut TcpStream, shared: &Shared) -> std::io::Result<()> {
    let kind = "multipart/x-mixed-replace; boundary=sdg-picture";
    stream.write_all(format!("{}\r\n--sdg-picture\r\n", head("200 OK", kind)).as_bytes())?;
    let mut last = None;
    while let Some(published) = next_picture(shared, last) {
        last = Some(published.number);
        let jpeg = published.jpeg();
        let part = format!("Content-Type: image/jpeg\r\nContent-Length: {}\r\n\r\n", jpeg.len());
        stream.write_all(part.as_bytes())?;
        stream.write_all(jpeg)?;
        // Chromium shows a part when the next boundary arrives. Without this boundary, each picture would be shown one
        // picture late.
        stream.write_all(b"\r\n--sdg-picture\r\n")?;
    }
    Ok(())
}

/// Waits for a picture after number `last`; `None` if the server ends and its newest picture was taken.
fn next_picture(shared: &Shared, last: Option<u64>) -> Option<Arc<Published>> {
    let mut newest = shared.newest.lock().unwrap_or_else(PoisonError::into_inner);
    loop {
        match newest.as_ref() {
            Some(published) if Some(published.number) != last => return Some(Arc::clone(published)),
            _ if shared.is_stopped.load(Ordering::SeqCst) => return None,
            _ => newest = shared.changed.wait_timeout(newest, POLL_INTERVAL).unwrap_or_else(PoisonError::into_inner).0,
        }
    }
}
