//! The annotation page's server: HTTP, the checks of host, origin and token, and the routes, over TCP.

use std::net::{Ipv4Addr, TcpStream};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use sdg_annotate::{
    GraspTeacher, Live, LiveFrame, LiveOptions, LivePictures, RecentProjects, Region, Searched, Server, Session,
    SessionOptions, Start, TaughtModel, TaughtSummary, TeachRequest, TeacherError, TeachingMaterial, TeachingStep,
};
use sdg_demonstration::{Demonstration, PixelFrame};

use super::bytes::{SEED_PORT, contains, replaced, split_at_marks};
use super::cameras::exchange;
use super::pictures::{encoded, picture};
use crate::target::Target;

/// The page's token in the seeds.
const TOKEN: &str = "0123456789abcdef0123456789abcdef";
const MAX_EXTRA_BYTES: usize = 256 << 20;
/// An idle connection is closed after this time; the program waits half a minute.
const PATIENCE: Duration = Duration::from_millis(50);
const DICTIONARY: &[&[u8]] = &[
    b"GET ",
    b"PUT ",
    b"POST ",
    b"DELETE ",
    b"/api/images/0/",
    b"/api/trial-pictures/0/",
    b"/api/live/0/",
    b"/api/others/0/",
    b"/api/models/0/",
    b"/api/projects",
    b"?name=%2e%2e%2f",
    b"Host: 127.0.0.1:4000\r\n",
    b"Origin: http://evil.example\r\n",
    b"Transfer-Encoding: chunked\r\n",
    b"Content-Length: ",
    b"Sdg-Session: 0\r\n",
    b"\r\n\r\n",
    b"\"box\":[1,2,3,4]",
    b"null",
    b"[]",
    b"{}",
    b"1e308",
    NEXT_REQUEST,
];

/// A page with a photo, a camera and a trial picture.
pub(super) const PAGE: Target = Target {
    name: "page",
    max_extra_bytes: MAX_EXTRA_BYTES,
    quick_executions: 300,
    dictionary: DICTIONARY,
    seeds: || {
        let png: &[u8] = &encoded(image::ImageFormat::Png);
        let marks: &[u8] = br#"{"box":[4,4,20,14],"grasp":{"start":[6,8],"end":[18,8],"jaw_width":9},"outline":[[4,4],[20,4],[20,14]]}"#;
        let strokes = br#"{"box":[4,4,20,14],"strokes":[{"points":[[5,5],[9,9]],"is_inside":true}]}"#;
        let teaching: &[u8] = br#"{"model":"S","time_budget_secs":1,"steps":3}"#;
        let session = ("GET", "/api/session", b"".as_slice());
        let live = ("GET", "/api/live", b"".as_slice());
        let marked = ("PUT", "/api/images/0/marks", marks);
        both_ways(&[
            &[("GET", "/", b"")],
            &[("GET", "/page/main.js", b"")],
            &[session],
            &[("PUT", "/api/label", br#"{"label":"bracket"}"#)],
            &[("PUT", "/api/region", br#"{"x":1,"y":2,"width":20,"height":12}"#)],
            &[("GET", "/api/images/0/picture", b"")],
            &[marked],
            &[("POST", "/api/images/0/outline", strokes)],
            &[("DELETE", "/api/images/0", b"")],
            &[("GET", "/api/teaching", b"")],
            &[("DELETE", "/api/teaching", b"")],
            &[("POST", "/api/images?name=a%20b.png", png)],
            &[("POST", "/api/trial-pictures?name=a.png", png)],
            &[("GET", "/api/trial-pictures/0/picture", b"")],
            &[("POST", "/api/trial-pictures/0/accept", marks)],
            &[("PUT", "/api/trial-pictures/0/absent", br#"{"absent":true}"#)],
            &[("DELETE", "/api/trial-pictures/0", b""), ("POST", "/api/trial-pictures/0/put-back", b"")],
            &[live, ("GET", "/api/live/3/picture", b"")],
            &[live, ("POST", "/api/live/3/photo", b"")],
            &[live, ("POST", "/api/live/3/keep", b"")],
            &[live, ("POST", "/api/live/3/hold", b"")],
            &[live, ("POST", "/api/live/3/detect", b"")],
            &[marked, ("GET", "/api/images/0/samples/1?seed=7", b"")],
            &[marked, ("POST", "/api/teaching", teaching)],
            &[session, ("GET", "/api/others/0/picture", b"")],
            &[session, ("POST", "/api/others/0/photo", b"")],
            &[session, ("POST", "/api/others/0/try", b"")],
            &[session, ("POST", "/api/trial-pictures/0/detect", b"")],
            &[session, ("POST", "/api/trial-pictures/0/would-help", br#"{"marks":{},"others":[]}"#)],
            &[session, ("PUT", "/api/models/0/current", b"")],
            &[session, ("POST", "/api/models/0/compare/1", b"")],
        ])
    },
    run: |bytes| asked(bytes, &SESSION, serve_session),
};

/// The page before a project is chosen.
pub(super) const START_PAGE: Target = Target {
    name: "start_page",
    max_extra_bytes: MAX_EXTRA_BYTES,
    quick_executions: 300,
    dictionary: DICTIONARY,
    seeds: || {
        let png: &[u8] = &encoded(image::ImageFormat::Png);
        let new = ("POST", "/api/projects?name=bracket&photo=a.png", png);
        let session = ("GET", "/api/session", b"".as_slice());
        both_ways(&[
            &[session],
            &[("DELETE", "/api/projects", b"")],
            &[session, ("POST", "/api/projects/0/open", b"")],
            &[new, session, ("DELETE", "/api/projects", b"")],
            &[new],
        ])
    },
    run: |bytes| asked(bytes, &START, serve_start),
};

/// Prefix of inputs whose requests have no heads: `METHOD PATH`, a line end, a body. Each request gets a valid head
/// with its body's length, so that mistakes reach the routes.
const HEADLESS: &[u8] = b"\x02";
/// Separates requests without heads.
const NEXT_REQUEST: &[u8] = b"\x1enext\x1e";

/// Adds heads to requests without heads.
fn with_heads(requests: &[u8]) -> Vec<u8> {
    let requests = split_at_marks(requests, NEXT_REQUEST);
    let last = requests.len() - 1;
    let whole = requests.iter().enumerate().map(|(idx, bytes)| {
        let line = bytes.iter().position(|byte| *byte == b'\n').unwrap_or(bytes.len());
        let (line, body) = (String::from_utf8_lossy(&bytes[..line]), bytes.get(line + 1..).unwrap_or_default());
        let (method, path) = line.split_once(' ').unwrap_or((&line, ""));
        if idx == last { request(method, path, body) } else { kept_open(method, path, body) }
    });
    whole.collect::<Vec<_>>().concat()
}

/// The seeds with and without heads.
fn both_ways(connections: &[&[(&str, &str, &[u8])]]) -> Vec<Vec<u8>> {
    let headless = |requests: &&[(&str, &str, &[u8])]| {
        let lines = requests
            .iter()
            .map(|(method, path, body)| [method.as_bytes(), b" ", path.as_bytes(), b"\n", body].concat());
        [HEADLESS, lines.collect::<Vec<_>>().join(NEXT_REQUEST).as_slice()].concat()
    };
    let without: Vec<Vec<u8>> = connections.iter().map(headless).collect();
    let with = without.iter().map(|requests| with_heads(&requests[HEADLESS.len()..]));
    with.chain(without.iter().cloned()).collect()
}

/// A request after which the connection closes.
fn request(method: &str, path: &str, body: &[u8]) -> Vec<u8> {
    replaced(&kept_open(method, path, body), b"Content-Length", b"Connection: close\r\nContent-Length")
}

/// A request after which the connection stays open.
fn kept_open(method: &str, path: &str, body: &[u8]) -> Vec<u8> {
    let head = format!(
        "{method} {path} HTTP/1.1\r\nHost: 127.0.0.1:4000\r\nCookie: sdg-annotate-4000={TOKEN}\r\nOrigin: http://localhost:4000\r\n\
         Content-Length: {}\r\n\r\n",
        body.len()
    );
    [head.as_bytes(), body].concat()
}

/// A server with its own folder; dropping this value stops the server.
struct Serving {
    port: u16,
    _folder: tempfile::TempDir,
    is_stopping: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

static SESSION: Mutex<Option<Serving>> = Mutex::new(None);
static START: Mutex<Option<Serving>> = Mutex::new(None);

/// Sends the input to a server in its initial state.
fn asked(bytes: &[u8], kept: &Mutex<Option<Serving>>, serve: fn() -> Serving) -> bool {
    let mut kept = kept.lock().unwrap_or_else(PoisonError::into_inner);
    let port = kept.get_or_insert_with(serve).port;
    let whole = bytes.strip_prefix(HEADLESS).map_or_else(|| bytes.to_vec(), with_heads);
    let request = replaced(&whole, SEED_PORT, port.to_string().as_bytes());
    // The server treats a client that closes its sending direction as disconnected, so the direction stays open; the
    // idle timeout ends an incomplete request.
    let answer = exchange(port, &request, false);
    let is_answered = contains(&answer, b"HTTP/1.1 200 ");
    assert!(
        !contains(&answer, b"HTTP/1.1 500 "),
        "expected an answer or a refusal, found: {}",
        String::from_utf8_lossy(&answer)
    );
    assert!(
        !is_answered || contains(&request, TOKEN.as_bytes()),
        "expected a refusal, found an answer to a request without the token"
    );
    // After any change, the next execution gets a new server. A server is reused after a single request that only
    // reads.
    let is_reading =
        request.starts_with(b"GET ") && request.windows(4).filter(|window| window == b"\r\n\r\n").count() == 1;
    if !is_reading {
        *kept = None;
    }
    is_answered
}

fn folder() -> tempfile::TempDir {
    // In memory where possible, because the program syncs files to the disk whenever it writes them.
    let memory = Path::new("/dev/shm");
    let folder = if memory.is_dir() { tempfile::tempdir_in(memory) } else { tempfile::tempdir() };
    folder.expect("a folder for files that are thrown away")
}

fn serve_session() -> Serving {
    let folder = folder();
    let photo: PathBuf = folder.path().join("photo.png");
    for name in ["photo.png", "other.png", "tried.png"] {
        std::fs::write(folder.path().join(name), encoded(image::ImageFormat::Png)).expect("a file in this folder");
    }
    let live = LiveOptions {
        pictures: Arc::new(Still),
        address: "cmd:camera".into(),
        photo_path: folder.path().join("taken.png"),
    };
    let options = SessionOptions {
        images: vec![(photo, None)],
        trial_pictures: vec![folder.path().join("tried.png")],
        live: Some(live),
        token: Some(TOKEN.to_owned()),
        ..SessionOptions::default()
    };
    let session = Session::open(&options, Arc::new(Unwilling)).expect("a session with a photo");
    serve(folder, Server::bind(session, 0).expect("a port of this computer"))
}

fn serve_start() -> Serving {
    let folder = folder();
    let recent = RecentProjects::at(folder.path().join("state/recent.json"));
    let open = |path: &Path| {
        let options = SessionOptions { project: Some(path.to_owned()), ..SessionOptions::default() };
        Ok(Session::open(&options, Arc::new(Unwilling))?)
    };
    let start = Start {
        recent: Some(recent),
        folder: folder.path().to_owned(),
        pixel_frame: PixelFrame::Upright,
        photo_size: None,
        open: Box::new(open),
    };
    serve(folder, Server::bind_start(start, 0, Some(TOKEN)).expect("a port of this computer"))
}

fn serve(folder: tempfile::TempDir, server: Server) -> Serving {
    let url = server.url();
    let port = url.split(['/', ':']).find_map(|piece| piece.parse().ok()).expect("an address with a port");
    let is_stopping = Arc::new(AtomicBool::new(false));
    let asked = Arc::clone(&is_stopping);
    let thread = thread::spawn(move || {
        // An error of the server only means that no answer comes.
        let _ = server.with_patience(PATIENCE).run(move || asked.load(Ordering::SeqCst));
    });
    Serving { port, _folder: folder, is_stopping, thread: Some(thread) }
}

impl Drop for Serving {
    fn drop(&mut self) {
        self.is_stopping.store(true, Ordering::SeqCst);
        // The server checks whether to stop after each connection.
        let _ = TcpStream::connect((Ipv4Addr::LOCALHOST, self.port));
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// A camera that always returns the same frame.
#[derive(Debug)]
struct Still;

impl LivePictures for Still {
    fn newest(&self) -> Live {
        let frame = LiveFrame { picture: Arc::new(picture()), number: 3, age: Duration::from_millis(20) };
        Live { frame: Some(frame), fault: None }
    }
}

/// A teacher that refuses to teach and to open models, because other targets test models.
struct Unwilling;

const REFUSED: &str = "nothing is taught here";

impl GraspTeacher for Unwilling {
    fn teach(
        &self,
        _: &TeachingMaterial,
        _: &TeachRequest,
        _: &mut dyn FnMut(TeachingStep) -> ControlFlow<()>,
    ) -> Result<Box<dyn TaughtModel>, TeacherError> {
        Err(REFUSED.into())
    }

    fn teach_on_trial(&self, _: &TeachingMaterial, _: &TeachRequest) -> Result<Box<dyn TaughtModel>, TeacherError> {
        Err(REFUSED.into())
    }

    fn check_region(&self, _: &Region, _: &[Demonstration]) -> Result<(), TeacherError> {
        Ok(())
    }

    fn open(&self, _: &[u8], _: &TaughtSummary, _: Option<Searched>) -> Result<Box<dyn TaughtModel>, TeacherError> {
        Err(REFUSED.into())
    }
}
