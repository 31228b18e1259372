//! A server that runs a script, and pictures that can be told apart.

use std::io::{Read, Write};
use std::net::{Ipv4Addr, TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use image::codecs::jpeg::JpegEncoder;
use image::{Rgb, RgbImage};
use sdg_camera::{Address, Camera, CameraError, Frame, OpenOptions};

/// Time without a frame after which a camera of these tests is stale.
pub const STALL_TIMEOUT: Duration = Duration::from_millis(400);

/// Actions on a connection after its request was read.
pub type Script = Box<dyn Fn(&mut TcpStream) + Send + Sync>;

/// A JPEG of one level of grey.
pub fn jpeg(level: u8) -> Vec<u8> {
    let mut bytes = Vec::new();
    let picture = RgbImage::from_pixel(64, 48, Rgb([level; 3]));
    JpegEncoder::new_with_quality(&mut bytes, 90).encode_image(&picture).unwrap();
    bytes
}

/// A part with a picture of this level; the boundary is `cut`.
pub fn part(level: u8, has_length: bool) -> Vec<u8> {
    let picture = jpeg(level);
    let length = if has_length { format!("Content-Length: {}\r\n", picture.len()) } else { String::new() };
    [b"--cut\r\nContent-Type: image/jpeg\r\n", length.as_bytes(), b"\r\n", &picture, b"\r\n"].concat()
}

/// The grey level of a frame.
pub fn level_of(frame: &Frame) -> u8 {
    frame.picture.get_pixel(20, 20)[0]
}

pub fn try_open(address: &str) -> Result<Box<dyn Camera>, CameraError> {
    let options = OpenOptions { stall_timeout: STALL_TIMEOUT, fps: Some(50.0), ..OpenOptions::default() };
    sdg_camera::open(&address.parse::<Address>()?, &options)
}

pub fn open(address: &str) -> Box<dyn Camera> {
    try_open(address).unwrap()
}

/// A server on 127.0.0.1 that reads one request at a time, until it is dropped.
pub struct Server {
    port: u16,
    is_stopped: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Server {
    /// Starts a server. The n-th connection runs the n-th script; later connections run `further`.
    pub fn start(scripts: Vec<Script>, further: Script) -> Self {
        Self::start_at(0, scripts, further)
    }

    pub fn start_at(port: u16, scripts: Vec<Script>, further: Script) -> Self {
        let mut scripts = scripts.into_iter();
        let further = Arc::new(further);
        Self::serve(port, move |mut stream, _| {
            let next = scripts.next();
            let further = Arc::clone(&further);
            // A thread for each connection, because scripts sleep.
            std::thread::spawn(move || match next {
                Some(script) => script(&mut stream),
                None => further(&mut stream),
            });
        })
    }

    /// Starts a server that passes each request to the closure.
    pub fn start_with_requests(answer: impl Fn(&str, &mut TcpStream) + Send + 'static) -> Self {
        Self::serve(0, move |mut stream, request| answer(&request, &mut stream))
    }

    fn serve(port: u16, mut connection: impl FnMut(TcpStream, String) + Send + 'static) -> Self {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port)).unwrap();
        let port = listener.local_addr().unwrap().port();
        let is_stopped = Arc::new(AtomicBool::new(false));
        let stopping = Arc::clone(&is_stopped);
        let thread = std::thread::spawn(move || {
            for stream in listener.incoming() {
                if stopping.load(Ordering::SeqCst) {
                    return;
                }
                let mut stream = stream.unwrap();
                let mut request = Vec::new();
                let mut byte = [0];
                while !request.ends_with(b"\r\n\r\n") && stream.read(&mut byte).is_ok_and(|count| count > 0) {
                    request.push(byte[0]);
                }
                connection(stream, String::from_utf8(request).unwrap());
            }
        });
        Self { port, is_stopped, thread: Some(thread) }
    }

    pub fn port(&self) -> u16 {
        self.port
    }

    pub fn url(&self, path: &str) -> String {
        format!("http://127.0.0.1:{}{path}", self.port)
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        self.is_stopped.store(true, Ordering::SeqCst);
        let _ = TcpStream::connect((Ipv4Addr::LOCALHOST, self.port)).map(|mut stream| stream.write_all(b"\r\n\r\n"));
        self.thread.take().unwrap().join().unwrap();
    }
}
