//! Servers of motion JPEG and snapshots that stall, cut pictures, send garbage, redirect and flood. The client
//! survives, reports the fault, and recovers.

use std::io::Write;
use std::net::TcpStream;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::sleep;
use std::time::{Duration, Instant, SystemTime};

use crate::support;
use sdg_camera::{Camera, CameraError, Fault, OpenOptions};
use support::{Script, Server, jpeg, level_of, open, part};

const OK: &str = "HTTP/1.1 200 OK\r\nContent-Type: multipart/x-mixed-replace; boundary=cut\r\n\r\n";

/// A server without faults: three pictures of level 200, then no more data.
fn recover(stream: &mut TcpStream) {
    let _ = stream.write_all(OK.as_bytes());
    for _ in 0..3 {
        let _ = stream.write_all(&part(200, true));
        sleep(Duration::from_millis(30));
    }
    sleep(Duration::from_secs(20));
}

/// The faults until a picture of this level arrives, and the faults of that picture.
fn faults_until(camera: &mut dyn Camera, level: u8) -> Vec<Fault> {
    let mut faults = Vec::new();
    let start = Instant::now();
    loop {
        assert!(start.elapsed() < Duration::from_secs(30), "no picture of level {level}: {faults:?}");
        match camera.next_frame() {
            Ok(Some(frame)) => {
                let is_wanted = level_of(&frame).abs_diff(level) < 5;
                faults.extend(frame.faults);
                if is_wanted {
                    return faults;
                }
            }
            Ok(None) => panic!("the camera ended: {faults:?}"),
            Err(error) => {
                assert!(error.is_passing(), "{error}");
                faults.push(error.fault().unwrap().clone());
            }
        }
    }
}

/// The faults of a connection that runs `script` after one good picture; the next connection recovers.
fn faults_of(script: impl Fn(&mut TcpStream) + Send + Sync + 'static) -> Vec<Fault> {
    let first: Script = Box::new(move |stream| {
        let _ = stream.write_all(OK.as_bytes());
        let _ = stream.write_all(&part(100, true));
        sleep(Duration::from_millis(50));
        script(stream);
    });
    let server = Server::start(vec![first], Box::new(recover));
    let mut camera = open(&server.url("/"));
    assert_eq!(faults_until(camera.as_mut(), 100), []);
    let faults = faults_until(camera.as_mut(), 200);
    assert!(matches!(faults.last(), Some(Fault::Back { .. })), "{faults:?}");
    faults
}

fn gone_because(faults: &[Fault], part: &str) {
    let is_told = faults.iter().any(|fault| matches!(fault, Fault::Gone { why } if why.contains(part)));
    assert!(is_told, "expected a loss with \"{part}\" in {faults:?}");
}

#[test]
fn a_stall_is_stale_and_a_connection_that_stays_silent_is_opened_again() {
    let faults = faults_of(|_| sleep(Duration::from_secs(20)));
    assert!(matches!(faults[0], Fault::Stale { silent_secs } if silent_secs >= 0.4), "{faults:?}");
    gone_because(&faults, "no frame for");
}

#[test]
fn a_stall_in_mid_picture_loses_nothing_when_it_goes_on() {
    let picture = part(150, true);
    let server = Server::start(
        vec![Box::new(move |stream| {
            stream.write_all(OK.as_bytes()).unwrap();
            let (half, rest) = picture.split_at(picture.len() / 2);
            stream.write_all(half).unwrap();
            sleep(Duration::from_millis(600));
            stream.write_all(rest).unwrap();
            sleep(Duration::from_secs(20));
        })],
        Box::new(recover),
    );
    let mut camera = open(&server.url("/"));
    let faults = faults_until(camera.as_mut(), 150);
    assert!(matches!(faults[..], [Fault::Stale { .. }]), "{faults:?}");
}

#[test]
fn a_cut_in_mid_picture_is_told() {
    let half = part(150, true);
    let half = half[..half.len() / 2].to_vec();
    gone_because(&faults_of(move |stream| stream.write_all(&half).unwrap()), "middle of a picture");
    gone_because(&faults_of(|_| ()), "closed the connection");
}

#[test]
fn a_torn_picture_is_not_delivered_and_the_next_one_is() {
    let picture = jpeg(150);
    let torn = [b"--cut\r\n\r\n".as_slice(), &picture[..picture.len() / 2], b"\r\n"].concat();
    let faults = faults_of(move |stream| {
        stream.write_all(&[torn.as_slice(), b"--cut\r\n"].concat()).unwrap();
        // Of two available pictures, the client skips the older one. The pause lets it read the torn one first.
        sleep(Duration::from_millis(100));
        stream.write_all(&part(150, false)).unwrap();
        stream.write_all(b"--cut\r\n").unwrap();
        sleep(Duration::from_millis(100));
    });
    assert!(matches!(&faults[0], Fault::Torn { found } if found.contains("without its end marker")), "{faults:?}");
}

#[test]
fn garbage_is_told() {
    let faults = faults_of(|stream| {
        stream.write_all(b"--cut\r\n\r\nthis is no picture\r\n--cut\r\n").unwrap();
        sleep(Duration::from_millis(100));
    });
    assert!(
        matches!(&faults[0], Fault::Torn { found } if found.contains("expected a PNG, JPEG, WebP, BMP or TIFF")),
        "{faults:?}"
    );
    // Without another boundary, no data is kept and a stall is reported.
    let faults = faults_of(|stream| while stream.write_all(&[0x55; 1 << 16]).is_ok() {});
    assert!(matches!(faults[0], Fault::Stale { .. }), "{faults:?}");
}

#[test]
fn heads_without_end_and_parts_without_bound_are_given_up() {
    let faults = faults_of(|stream| {
        let _ = stream.write_all(b"--cut\r\nX: ");
        while stream.write_all(&[b'a'; 4096]).is_ok() {}
    });
    gone_because(&faults, "head of at most 16384 bytes");
    let faults = faults_of(|stream| {
        let _ = stream.write_all(b"--cut\r\nContent-Length: 4000000000\r\n\r\n");
        sleep(Duration::from_secs(5));
    });
    gone_because(&faults, "at most 33554432 bytes, found \"4000000000\"");
}

#[test]
fn a_part_that_does_not_end_is_given_up() {
    let faults = faults_of(|stream| {
        let _ = stream.write_all(b"--cut\r\n\r\n\xff\xd8");
        while stream.write_all(&[0; 1 << 16]).is_ok() {}
    });
    let is_bounded = |fault: &Fault| match fault {
        Fault::Gone { why } => why.contains("at most 33554432 bytes") || why.contains("no frame for"),
        _ => false,
    };
    assert!(faults.iter().any(is_bounded), "{faults:?}");
}

#[test]
fn of_a_flood_the_newest_picture_is_given_and_the_numbers_show_the_gap() {
    let flood: Script = Box::new(|stream| {
        stream.write_all(OK.as_bytes()).unwrap();
        for level in 0..100 {
            stream.write_all(&part(level * 2, level % 2 == 0)).unwrap();
        }
        stream.write_all(b"--cut\r\n").unwrap();
        sleep(Duration::from_secs(20));
    });
    let server = Server::start(vec![flood], Box::new(recover));
    let mut camera = open(&server.url("/"));
    sleep(Duration::from_millis(300));
    let mut num_frames = 0;
    loop {
        let frame = camera.next_frame().unwrap().unwrap();
        num_frames += 1;
        // All skipped pictures are counted: picture n has level 2 n.
        assert!(u64::from(level_of(&frame)).abs_diff(2 * frame.number) < 5, "{frame:?} {}", level_of(&frame));
        if frame.number == 99 {
            break;
        }
    }
    // All pictures have arrived long ago, so that one read is enough; a busy machine may need a few more.
    assert!(num_frames < 20, "{num_frames} of 100");
}

#[test]
fn chunks_and_pictures_without_length_are_read() {
    let chunked: Script = Box::new(|stream| {
        let head = OK.replace("\r\n\r\n", "\r\nTransfer-Encoding: chunked\r\n\r\n");
        stream.write_all(head.as_bytes()).unwrap();
        let body = [part(60, false), part(90, false), b"--cut\r\n".to_vec()].concat();
        for piece in body.chunks(777) {
            stream.write_all(format!("{:x}\r\n", piece.len()).as_bytes()).unwrap();
            stream.write_all(piece).unwrap();
            stream.write_all(b"\r\n").unwrap();
        }
        stream.write_all(b"0\r\n\r\n").unwrap();
    });
    let server = Server::start(vec![chunked], Box::new(recover));
    let mut camera = open(&server.url("/"));
    assert_eq!(faults_until(camera.as_mut(), 90), []);
    let faults = faults_until(camera.as_mut(), 200);
    gone_because(&faults, "the server closed the connection");
}

#[test]
fn redirects_are_followed_but_not_for_ever_and_not_elsewhere() {
    let redirect = |location: &'static str| -> Script {
        Box::new(move |stream| {
            let _ = stream.write_all(format!("HTTP/1.1 302 Found\r\nLocation: {location}\r\n\r\n").as_bytes());
        })
    };
    let server = Server::start(vec![redirect("/a"), redirect("b?c")], Box::new(recover));
    let mut camera = open(&server.url("/"));
    assert_eq!(faults_until(camera.as_mut(), 200), []);
    drop(camera);
    let refused = |script: Script, expected: &str| {
        let server = Server::start(vec![], script);
        let error = support::try_open(&server.url("/")).err().unwrap();
        assert!(matches!(error, CameraError::Open { .. }) && error.to_string().contains(expected), "{error}");
    };
    refused(redirect("/again"), "more than 5 redirects");
    refused(redirect("https://127.0.0.1/"), "a redirect that is not followed");
    refused(Box::new(|stream| stream.write_all(b"HTTP/1.1 302 Found\r\n\r\n").unwrap()), "a redirect's target");
}

#[test]
fn answers_without_pictures_are_refused_when_the_camera_is_opened() {
    let refused = |answer: &'static [u8], expected: &str| {
        let server = Server::start(vec![], Box::new(move |stream| stream.write_all(answer).unwrap()));
        let error = support::try_open(&server.url("/")).err().unwrap().to_string();
        assert!(error.contains(expected), "{error}");
    };
    refused(b"HTTP/1.1 404 Not Found\r\n\r\n", "status 200, found 404");
    refused(b"HTTP/1.1 401 Unauthorized\r\n\r\n", "USER:PASSWORD@");
    refused(b"HTTP/1.1 200 OK\r\nContent-Type: text/html\r\n\r\n<html>", "found text/html");
    refused(b"HTTP/1.1 200 OK\r\nContent-Type: multipart/x-mixed-replace\r\n\r\n", "boundary");
    refused(b"SSH-2.0-OpenSSH_9.2\r\n", "HTTP/1.1");
    refused(b"", "closed after 0 bytes");

    let endless: Script = Box::new(|stream| {
        let _ = stream.write_all(b"HTTP/1.1 200 OK\r\nX: ");
        while stream.write_all(&[b'a'; 4096]).is_ok() {}
    });
    let server = Server::start(vec![], endless);
    assert!(support::try_open(&server.url("/")).err().unwrap().to_string().contains("head of at most 16384 bytes"));
    let silent = Server::start(vec![], Box::new(|_| sleep(Duration::from_secs(5))));
    let start = Instant::now();
    assert!(support::try_open(&silent.url("/")).err().unwrap().to_string().contains("time"));
    assert!(start.elapsed() < Duration::from_secs(3));
}

#[test]
fn a_server_that_went_away_comes_back() {
    let server = Server::start(vec![], Box::new(recover));
    let url = server.url("/");
    let port = server.port();
    let mut camera = open(&url);
    assert_eq!(faults_until(camera.as_mut(), 200), []);
    drop(server);
    let start = Instant::now();
    let mut gone = 0;
    while start.elapsed() < Duration::from_secs(4) {
        match camera.next_frame() {
            Err(error) => gone += usize::from(matches!(error.fault(), Some(Fault::Gone { .. }))),
            Ok(frame) => assert!(frame.is_some()),
        }
    }
    assert!(gone > 1, "told again and again");
    let _server = Server::start_at(port, vec![], Box::new(recover));
    let faults = faults_until(camera.as_mut(), 200);
    assert!(matches!(faults.last(), Some(Fault::Back { away_secs }) if *away_secs > 0.5), "{faults:?}");
}

/// A camera of single pictures that requires authentication; also returns the authenticated requests, and the number of
/// other requests.
fn locked_server(challenges: &'static str) -> (Server, Arc<Mutex<Vec<String>>>, Arc<AtomicUsize>) {
    let asked = Arc::new(Mutex::new(Vec::new()));
    let refused = Arc::new(AtomicUsize::new(0));
    let (log, num_refused) = (Arc::clone(&asked), Arc::clone(&refused));
    let server = Server::start_with_requests(move |request, stream| {
        assert!(request.starts_with("GET /shot.jpg HTTP/1.1\r\n"), "{request}");
        if !request.contains("Authorization: ") {
            num_refused.fetch_add(1, Ordering::SeqCst);
            let head = format!("HTTP/1.1 401 Unauthorized\r\n{challenges}Content-Length: 0\r\n\r\n");
            return stream.write_all(head.as_bytes()).unwrap();
        }
        let mut log = log.lock().unwrap();
        log.push(request.to_owned());
        let picture = jpeg(50 + 10 * log.len() as u8);
        let cut = if log.len() == 3 { picture.len() / 2 } else { picture.len() };
        let head = format!("HTTP/1.1 200 OK\r\nContent-Type: image/jpeg\r\nContent-Length: {}\r\n\r\n", picture.len());
        stream.write_all(head.as_bytes()).unwrap();
        stream.write_all(&picture[..cut]).unwrap();
    });
    (server, asked, refused)
}

#[test]
fn snapshots_are_fetched_again_and_again_with_the_password() {
    let (server, asked, refused) = locked_server("WWW-Authenticate: Basic realm=\"cam\"\r\n");
    let mut camera = open(&format!("http://me:secret@127.0.0.1:{}/shot.jpg", server.port()));
    for expected in [60, 70] {
        let frame = camera.next_frame().unwrap().unwrap();
        assert!(level_of(&frame).abs_diff(expected) < 5, "{}", level_of(&frame));
        assert_eq!(&*frame.camera, format!("http://me:***@127.0.0.1:{}/shot.jpg", server.port()));
    }
    assert!(matches!(camera.next_frame().unwrap_err().fault(), Some(Fault::Torn { .. })));
    assert!(level_of(&camera.next_frame().unwrap().unwrap()).abs_diff(90) < 5);
    for request in asked.lock().unwrap().iter() {
        // Base64 of me:secret.
        assert!(request.contains("Authorization: Basic bWU6c2VjcmV0\r\n"), "{request}");
    }
    // After the first challenge, each request is authenticated.
    assert_eq!(refused.load(Ordering::SeqCst), 1);
}

#[test]
fn a_snapshot_counts_as_taken_before_its_request() {
    let asked = Arc::new(Mutex::new(Vec::new()));
    let log = Arc::clone(&asked);
    let server = Server::start_with_requests(move |_, stream| {
        log.lock().unwrap().push(SystemTime::now());
        sleep(Duration::from_millis(50));
        stream.write_all(b"HTTP/1.1 200 OK\r\nContent-Type: image/jpeg\r\n\r\n").unwrap();
        stream.write_all(&jpeg(100)).unwrap();
    });
    let mut camera = open(&server.url("/shot.jpg"));
    for idx in 0..2 {
        let captured = camera.next_frame().unwrap().unwrap().captured;
        let received = asked.lock().unwrap()[idx];
        assert!(captured <= received, "{captured:?} {received:?}");
    }
}

#[test]
fn a_picture_that_does_not_end_is_given_up() {
    let num_asked = AtomicUsize::new(0);
    let server = Server::start_with_requests(move |_, stream| {
        let _ = stream.write_all(b"HTTP/1.1 200 OK\r\nContent-Type: image/jpeg\r\n\r\n");
        let _ = stream.write_all(&jpeg(100));
        // The first answer ends, as the camera is opened with it.
        if num_asked.fetch_add(1, Ordering::SeqCst) > 0 {
            while stream.write_all(&[0; 1 << 16]).is_ok() {}
        }
    });
    // The other tests' cameras are stale after a shorter time than a busy machine needs for so many bytes.
    let mut camera = sdg_camera::open(&server.url("/shot.jpg").parse().unwrap(), &OpenOptions::default()).unwrap();
    camera.next_frame().unwrap();
    let is_told = (0..20).any(|_| match camera.next_frame().unwrap_err().fault() {
        Some(Fault::Gone { why }) => why.contains("at most 33554432 bytes"),
        _ => false,
    });
    assert!(is_told);
}

#[test]
fn a_camera_with_digest_authentication_is_given_no_password() {
    let (server, asked, _) = locked_server(
        "WWW-Authenticate: Digest realm=\"cam\", nonce=\"0123\", algorithm=MD5\r\nWWW-Authenticate: Basic realm=\"cam\"\r\n",
    );
    let mut camera = open(&format!("http://me:secret@127.0.0.1:{}/shot.jpg", server.port()));
    assert!(level_of(&camera.next_frame().unwrap().unwrap()).abs_diff(60) < 5);
    let asked = asked.lock().unwrap();
    // MD5 of "MD5(me:cam:secret):0123:MD5(GET:/shot.jpg)", by Python's hashlib.
    assert!(asked[0].contains("Authorization: Digest username=\"me\", realm=\"cam\", "), "{}", asked[0]);
    assert!(asked[0].contains("response=\"6c7e16a34d86f066385e2785cecac31d\""), "{}", asked[0]);
}

#[test]
fn a_picture_that_drips_is_late_and_not_waited_for() {
    let dripping: Script = Box::new(|stream| {
        let _ = stream.write_all(OK.as_bytes());
        for byte in part(150, true) {
            if stream.write_all(&[byte]).is_err() {
                return;
            }
            sleep(Duration::from_millis(20));
        }
    });
    let server = Server::start(vec![dripping], Box::new(recover));
    let mut camera = open(&server.url("/"));
    let start = Instant::now();
    assert!(matches!(camera.next_frame().unwrap_err().fault(), Some(Fault::Stale { .. })));
    assert!(start.elapsed() < Duration::from_secs(3));
    assert!(faults_until(camera.as_mut(), 200).len() > 1);
}
