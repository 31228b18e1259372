//! HTTP: answers of a camera's server, and requests of a browser to the live page.

use std::io::{Read, Write};
use std::net::{Ipv4Addr, Shutdown, TcpListener, TcpStream};
use std::sync::{Arc, LazyLock, Mutex, PoisonError};
use std::thread;
use std::time::Duration;

use sdg_camera::{MjpegServer, OpenOptions, Url, read_pictures};

use super::bytes::{SEED_PORT, contains, replaced, split_at_marks};
use super::pictures::{encoded, picture};
use crate::target::Target;

/// Separates the answers of one input; each goes to a separate connection.
const NEXT_ANSWER: &[u8] = b"\x1enext\x1e";
/// Far above the time that this computer needs for an answer, and far below [`MAX_SECONDS`](crate::MAX_SECONDS).
const TIMEOUT: Duration = Duration::from_secs(2);

/// The client for cameras: motion JPEG and single pictures, redirects and authentication challenges, over TCP.
pub(super) const HTTP_CAMERA: Target = Target {
    name: "http_camera",
    // The program's own limit: eight bytes for each of 210 megapixels, and 32 MiB of an encoded picture.
    max_extra_bytes: 1_720_000_000,
    quick_executions: 1_000,
    dictionary: &[
        b"HTTP/1.1 200 OK\r\n",
        b"HTTP/1.1 100 Continue\r\n\r\n",
        b"HTTP/1.1 401 Unauthorized\r\n",
        b"Content-Type: multipart/x-mixed-replace; boundary=--x\r\n",
        b"Content-Type: image/jpeg\r\n",
        b"Content-Length: ",
        b"Transfer-Encoding: chunked\r\n",
        b"WWW-Authenticate: Digest realm=\"a\", nonce=\"b\", qop=\"auth,auth-int\"\r\n",
        b"Location: /b\r\n",
        b"\r\n--x\r\n",
        b"--x--\r\n",
        b"\r\n\r\n",
        b"0\r\n\r\n",
        b"ffffffffffffffff\r\n",
        NEXT_ANSWER,
    ],
    seeds: camera_answers,
    run: |bytes| {
        // The client would connect to any host that a redirect names; the test may connect to this computer only.
        if contains(&bytes.to_ascii_lowercase(), b"location") && contains(bytes, b"//") {
            return false;
        }
        let server = &*ANSWERING;
        let answers = split_at_marks(bytes, NEXT_ANSWER);
        *server.answers.lock().unwrap_or_else(PoisonError::into_inner) = answers.into_iter().rev().collect();
        let Ok(url) = format!("http://me:secret@127.0.0.1:{}/a/b?c", server.port).parse::<Url>() else { return false };
        let options = OpenOptions { fps: Some(1000.0), ..OpenOptions::default() };
        read_pictures(&url, &options, TIMEOUT, 4).is_ok_and(|pictures| !pictures.is_empty())
    },
};

/// A server that sends each connection the next answer and closes it.
struct Answering {
    port: u16,
    /// In reverse order: the last one is sent first.
    answers: Arc<Mutex<Vec<Vec<u8>>>>,
}

static ANSWERING: LazyLock<Answering> = LazyLock::new(|| {
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).expect("a port of this computer");
    let port = listener.local_addr().expect("a bound port").port();
    let answers = Arc::new(Mutex::new(Vec::<Vec<u8>>::new()));
    let waiting = Arc::clone(&answers);
    thread::spawn(move || {
        for stream in listener.incoming().flatten() {
            let answer = waiting.lock().unwrap_or_else(PoisonError::into_inner).pop();
            // A client that closes the connection first is no error.
            let _ = give(stream, &answer.unwrap_or_default());
        }
    });
    Answering { port, answers }
});

fn give(mut stream: TcpStream, answer: &[u8]) -> std::io::Result<()> {
    stream.set_read_timeout(Some(TIMEOUT))?;
    stream.set_write_timeout(Some(TIMEOUT))?;
    let mut request = Vec::new();
    while !request.ends_with(b"\r\n\r\n") {
        let mut piece = [0; 1024];
        match stream.read(&mut piece)? {
            0 => return Ok(()),
            count => request.extend_from_slice(&piece[..count]),
        }
    }
    stream.write_all(answer)?;
    stream.shutdown(Shutdown::Write)?;
    // The kernel resets a connection that is closed with unread bytes, and the answer is lost.
    let _ = stream.read(&mut [0; 16]);
    Ok(())
}

fn camera_answers() -> Vec<Vec<u8>> {
    let jpeg = encoded(image::ImageFormat::Jpeg);
    let png = encoded(image::ImageFormat::Png);
    let head = |kind: &str, more: &str| format!("HTTP/1.1 200 OK\r\nContent-Type: {kind}\r\n{more}\r\n").into_bytes();
    let multipart = "multipart/x-mixed-replace; boundary=x";
    let sized = |picture: &[u8]| {
        let part = format!("--x\r\nContent-Type: image/jpeg\r\nContent-Length: {}\r\n\r\n", picture.len());
        [part.as_bytes(), picture, b"\r\n"].concat()
    };
    let unsized_part = [b"--x\r\n\r\n", jpeg.as_slice(), b"\r\n"].concat();
    let parts = [sized(&jpeg), unsized_part, sized(&png), b"--x--\r\n".to_vec()].concat();
    let (half, other_half) = parts.split_at(parts.len() / 2);
    let chunk = |bytes: &[u8]| [format!("{:x};a=b\r\n", bytes.len()).as_bytes(), bytes, b"\r\n"].concat();
    let chunks = [chunk(half), chunk(other_half), b"0\r\n\r\n".to_vec()].concat();
    let snapshot = [head("image/jpeg", &format!("Content-Length: {}\r\n", jpeg.len())), jpeg.clone()].concat();
    let to_the_end = [head("image/png", ""), png.clone()].concat();
    let challenge = |how: &str| {
        format!("HTTP/1.1 401 Unauthorized\r\nWWW-Authenticate: {how}\r\nContent-Length: 0\r\n\r\n").into_bytes()
    };
    let digest = challenge("Digest realm=\"camera\", qop=\"auth\", nonce=\"abc\", opaque=\"d\", algorithm=MD5");
    let redirect = b"HTTP/1.1 302 Found\r\nLocation: ../c?d\r\n\r\n".to_vec();
    let continued = [b"HTTP/1.1 100 Continue\r\n\r\n".as_slice(), &snapshot].concat();
    vec![
        [head(multipart, ""), parts].concat(),
        [head(multipart, "Transfer-Encoding: chunked\r\n"), chunks].concat(),
        [snapshot.as_slice(), NEXT_ANSWER, &to_the_end].concat(),
        [digest.as_slice(), NEXT_ANSWER, &snapshot].concat(),
        [&challenge("Basic realm=\"camera\""), NEXT_ANSWER, &snapshot].concat(),
        [redirect.as_slice(), NEXT_ANSWER, &continued].concat(),
    ]
}

/// The page with live pictures of `detect --draw` and of calibration, over TCP.
pub(super) const LIVE_PAGE: Target = Target {
    name: "live_page",
    max_extra_bytes: 8 << 20,
    quick_executions: 1_000,
    dictionary: &[b"GET ", b"POST ", b"HEAD ", b" HTTP/1.1\r\n", b"Host: ", b"Origin: ", b"/stream", b"/words", b"?"],
    seeds: || {
        let paths = ["/", "/page.js", "/stream", "/snapshot.jpg?1", "/words"];
        let request = |path: &&str| {
            format!(
                "GET {path} HTTP/1.1\r\nHost: localhost:4000\r\nOrigin: http://127.0.0.1:4000\r\nAccept: */*\r\n\r\n"
            )
        };
        paths.iter().map(request).map(String::into_bytes).collect()
    },
    run: |bytes| {
        static SERVER: Mutex<Option<MjpegServer>> = Mutex::new(None);
        let mut kept = SERVER.lock().unwrap_or_else(PoisonError::into_inner);
        let server = kept.get_or_insert_with(|| {
            let server = MjpegServer::start(0).expect("a port of this computer");
            server.publish(picture(), "a picture");
            server
        });
        let address = server.url();
        let port = address.trim_end_matches('/').rsplit(':').next().unwrap_or_default();
        let request = replaced(bytes, SEED_PORT, port.as_bytes());
        let answer = exchange(port.parse().unwrap_or_default(), &request, true);
        if contains(&answer, b"multipart/x-mixed-replace") {
            // The open stream would wait for the next picture, and the server allows few connections.
            *kept = None;
        }
        let names_us = [b"localhost:".as_slice(), b"127.0.0.1:"]
            .iter()
            .any(|name| contains(&request, &[name, port.as_bytes()].concat()));
        let is_answered = answer.starts_with(b"HTTP/1.1 200");
        assert!(names_us || !is_answered, "expected a refusal, found an answer to a request that names another host");
        is_answered
    },
};

/// Sends bytes; returns the answer until the other side closes or has sent a whole live picture. `then_close` closes
/// the sending direction.
pub(super) fn exchange(port: u16, request: &[u8], then_close: bool) -> Vec<u8> {
    let mut answer = Vec::new();
    let mut talk = || -> std::io::Result<()> {
        let mut stream = TcpStream::connect((Ipv4Addr::LOCALHOST, port))?;
        stream.set_read_timeout(Some(TIMEOUT))?;
        stream.set_write_timeout(Some(TIMEOUT))?;
        stream.write_all(request)?;
        if then_close {
            stream.shutdown(Shutdown::Write)?;
        }
        let mut piece = [0; 16 << 10];
        loop {
            match stream.read(&mut piece)? {
                0 => return Ok(()),
                count => answer.extend_from_slice(&piece[..count]),
            }
            if answer.ends_with(b"\xff\xd9\r\n--sdg-picture\r\n") {
                return Ok(());
            }
        }
    };
    // The server resets the connection where it rejects a request without reading all of it; the received bytes still
    // count.
    let _ = talk();
    answer
}
