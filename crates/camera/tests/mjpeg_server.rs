//! The server's stream, read by this crate's client and by clients that are slow, have another origin or violate the
//! protocol.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};

use image::{Rgb, RgbImage};
use sdg_camera::{Address, Camera, MjpegServer, OpenOptions};

fn picture(level: u8) -> RgbImage {
    RgbImage::from_pixel(640, 480, Rgb([level, level / 2, 255 - level]))
}

fn connect(server: &MjpegServer) -> TcpStream {
    let authority = server.url().trim_start_matches("http://").trim_end_matches('/').to_owned();
    let stream = TcpStream::connect(authority).unwrap();
    stream.set_read_timeout(Some(Duration::from_secs(5))).unwrap();
    stream
}

fn port(server: &MjpegServer) -> u16 {
    server.url().trim_end_matches('/').rsplit(':').next().unwrap().parse().unwrap()
}

/// The complete response to a request with these lines.
fn ask(server: &MjpegServer, lines: &str) -> String {
    let mut stream = connect(server);
    stream.write_all(format!("{lines}\r\n\r\n").replace("PORT", &port(server).to_string()).as_bytes()).unwrap();
    let mut answer = Vec::new();
    stream.read_to_end(&mut answer).unwrap();
    String::from_utf8_lossy(&answer).into_owned()
}

fn open(address: &str) -> Box<dyn Camera> {
    sdg_camera::open(&address.parse::<Address>().unwrap(), &OpenOptions::default()).unwrap()
}

#[test]
fn what_is_published_arrives_at_every_browser() {
    let server = MjpegServer::start(0).unwrap();
    let stream = format!("{}stream", server.url());
    server.publish(picture(100), format!("level {}", 100));
    let mut cameras = [open(&stream), open(&stream)];
    for level in [100, 150, 200] {
        server.publish(picture(level), format!("level {}", level));
        for camera in &mut cameras {
            // The new picture arrives without another one being published; the previous picture may come first.
            let arrived = loop {
                let frame = camera.next_frame().unwrap().unwrap();
                if frame.picture.get_pixel(9, 9)[0].abs_diff(level) < 5 {
                    break frame;
                }
            };
            assert_eq!(arrived.picture.dimensions(), (640, 480));
            let [_, green, blue] = arrived.picture.get_pixel(300, 200).0;
            assert!(green.abs_diff(level / 2) < 5 && blue.abs_diff(255 - level) < 5);
        }
    }
    let mut snapshots = open(&format!("{}snapshot.jpg", server.url()));
    assert!(snapshots.next_frame().unwrap().unwrap().picture.get_pixel(0, 0)[0].abs_diff(200) < 5);
}

#[test]
fn a_browser_that_reads_nothing_holds_nobody_up() {
    let server = MjpegServer::start(0).unwrap();
    let mut idle = connect(&server);
    idle.write_all(format!("GET /stream HTTP/1.1\r\nHost: 127.0.0.1:{}\r\n\r\n", port(&server)).as_bytes()).unwrap();
    let mut camera = open(&format!("{}stream", server.url()));
    let noise = |seed: u32| {
        RgbImage::from_fn(640, 480, |x, y| {
            Rgb([x.wrapping_mul(y).wrapping_mul(2_654_435_761).wrapping_add(seed) as u8; 3])
        })
    };
    let mut longest = Duration::ZERO;
    for seed in 0..100 {
        let picture = noise(seed);
        let start = Instant::now();
        server.publish(picture, "noise");
        longest = longest.max(start.elapsed());
        std::thread::sleep(Duration::from_millis(5));
    }
    // Publishing only stores a picture and never waits for browsers, even on a busy machine.
    assert!(longest < Duration::from_secs(1), "{longest:?}");
    let frame = camera.next_frame().unwrap().unwrap();
    assert_eq!(frame.picture.dimensions(), (640, 480));
    let start = Instant::now();
    drop(server);
    assert!(start.elapsed() < Duration::from_secs(2), "the end does not wait for browsers");
    drop(idle);
}

#[test]
fn the_last_picture_arrives_and_words_go_with_it() {
    let server = MjpegServer::start(0).unwrap();
    let words = |server: &MjpegServer| ask(server, "GET /words HTTP/1.1\r\nHost: localhost:PORT");
    assert!(words(&server).ends_with("\r\n\r\n"), "no picture, no words: {}", words(&server));
    let mut camera = open(&format!("{}stream", server.url()));
    server.publish(picture(50), "moving");
    camera.next_frame().unwrap().unwrap();
    server.publish(picture(200), "done, Größe 3");
    assert!(words(&server).ends_with("\r\n\r\ndone, Größe 3"), "{}", words(&server));
    drop(server);
    let level = camera.next_frame().unwrap().unwrap().picture.get_pixel(9, 9)[0];
    assert!(level.abs_diff(200) < 5, "{level}");
}

#[test]
fn foreign_names_other_pages_and_other_methods_are_refused() {
    let server = MjpegServer::start(0).unwrap();
    server.publish(picture(7), "level 7");
    for own in ["127.0.0.1", "localhost"] {
        assert!(ask(&server, &format!("GET / HTTP/1.1\r\nHost: {own}:PORT")).starts_with("HTTP/1.1 200 OK\r\n"));
    }
    for host in ["evil.example:PORT", "127.0.0.1", "127.0.0.1:1", "127.0.0.1:PORT.evil.example"] {
        let answer = ask(&server, &format!("GET /snapshot.jpg HTTP/1.1\r\nHost: {host}"));
        assert!(answer.starts_with("HTTP/1.1 403") && !answer.contains("JFIF"), "{host}: {answer}");
    }
    assert!(ask(&server, "GET / HTTP/1.1\r\nHost: 127.0.0.1:PORT\r\nHost: evil.example").starts_with("HTTP/1.1 403"));
    assert!(ask(&server, "GET / HTTP/1.1").starts_with("HTTP/1.1 403"));
    let origin =
        |origin: &str| ask(&server, &format!("GET /stream HTTP/1.1\r\nHost: 127.0.0.1:PORT\r\nOrigin: {origin}"));
    assert!(origin("http://evil.example").starts_with("HTTP/1.1 403"));
    assert!(origin("null").starts_with("HTTP/1.1 403"));
    assert!(ask(&server, "POST / HTTP/1.1\r\nHost: 127.0.0.1:PORT").starts_with("HTTP/1.1 405"));
    assert!(ask(&server, "GET /etc/passwd HTTP/1.1\r\nHost: 127.0.0.1:PORT").starts_with("HTTP/1.1 404"));
    assert!(ask(&server, "\x01\x02").starts_with("HTTP/1.1 400"));
}

#[test]
fn a_request_without_end_is_refused() {
    let server = MjpegServer::start(0).unwrap();
    let mut stream = connect(&server);
    // The last byte is the first one too many, so that the server has read all of them when it answers.
    let head = b"GET / HTTP/1.1\r\nX: ";
    stream.write_all(&[head.as_slice(), &vec![b'a'; (16 << 10) + 1 - head.len()]].concat()).unwrap();
    let mut answer = String::new();
    stream.read_to_string(&mut answer).unwrap();
    assert!(answer.starts_with("HTTP/1.1 400"), "{answer}");
}

#[test]
fn more_connections_than_any_user_needs_are_closed() {
    let server = MjpegServer::start(0).unwrap();
    server.publish(picture(7), "level 7");
    let request = format!("GET /stream HTTP/1.1\r\nHost: 127.0.0.1:{}\r\n\r\n", port(&server));
    let is_answered = |stream: &mut TcpStream| {
        stream.write_all(request.as_bytes()).is_ok() && stream.read(&mut [0; 8]).is_ok_and(|count| count > 0)
    };
    let mut open: Vec<TcpStream> = (0..32).map(|_| connect(&server)).collect();
    assert!(open.iter_mut().all(is_answered));
    assert!(!is_answered(&mut connect(&server)));
    // A place becomes free when the server notices that a browser has gone.
    open.pop();
    let start = Instant::now();
    while !is_answered(&mut connect(&server)) {
        assert!(start.elapsed() < Duration::from_secs(20), "no place became free");
        server.publish(picture(9), "level 9");
        std::thread::sleep(Duration::from_millis(50));
    }
}

#[test]
fn before_the_first_picture_and_on_a_port_that_is_taken() {
    let server = MjpegServer::start(0).unwrap();
    assert!(ask(&server, "GET /snapshot.jpg HTTP/1.1\r\nHost: localhost:PORT").starts_with("HTTP/1.1 503"));
    let error = MjpegServer::start(port(&server)).err().unwrap().to_string();
    assert!(error.contains(&port(&server).to_string()), "{error}");
}
