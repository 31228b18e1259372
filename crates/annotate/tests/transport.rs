//! The server's responses to malformed requests and to slow clients.

use std::time::{Duration, Instant};

use crate::served::{Served, Then};

/// The status of each answer on the connection.
fn statuses(answer: &str) -> Vec<u16> {
    answer.split("HTTP/1.1 ").skip(1).map(|rest| rest[..3].parse().unwrap()).collect()
}

#[test]
fn what_is_not_understood_is_refused() {
    let served = Served::start();
    let host = format!("Host: {}\r\nCookie: {}\r\n", served.host(), served.cookie());
    let refusal = |start: &str, rest: &str| {
        let answer = served.exchange(format!("{start}\r\n{host}{rest}").as_bytes(), Then::StaySilent);
        let found = statuses(&answer);
        assert_eq!(found.len(), 1, "{start} {rest}: {answer}");
        found[0]
    };
    assert_eq!(statuses(&served.exchange(b"\x16\x03\x01 a TLS greeting", Then::StaySilent)), [400]);
    assert_eq!(refusal("POST / HTTP/1.1", "Transfer-Encoding: chunked\r\n\r\n"), 411);
    assert_eq!(refusal("POST / HTTP/1.1", "Content-Length: 1\r\nContent-Length: 2\r\n\r\n"), 400);
    assert_eq!(refusal("POST / HTTP/1.1", "Content-Length: 1\r\nTransfer-Encoding: chunked\r\n\r\n"), 411);
    assert_eq!(refusal("POST / HTTP/1.1", "Content-Length: +1\r\n\r\n"), 400);
    assert_eq!(refusal("POST / HTTP/1.1", "Content-Length: 99999999999999999999999\r\n\r\n"), 400);
    assert_eq!(refusal("POST / HTTP/1.1", "Content-Length: 1048577\r\n\r\n"), 413);
    assert_eq!(refusal("GET / HTTP/1.1", &format!("X: {}", "a".repeat(20 << 10))), 431);
    assert_eq!(refusal("GET / HTTP/1.1", &format!("{}\r\n", "X: a\r\n".repeat(100))), 431);
}

#[test]
fn a_connection_that_breaks_off_is_no_request() {
    let served = Served::start();
    let half = format!("PUT /api/label HTTP/1.1\r\nHost: {}\r\nCookie: {}\r\n", served.host(), served.cookie());
    for bytes in ["", "GET / HT", &format!("{half}Content-Length: 30\r\n\r\n{{\"label\": \"half a name\"}}")] {
        assert_eq!(served.exchange(bytes.as_bytes(), Then::Close), "", "{bytes}");
    }
    assert!(!served.ask("GET", "/api/session", b"").text().contains("half a name"));
}

#[test]
fn silent_connections_are_closed() {
    let served = Served::with_patience(Duration::from_millis(200));
    let head = format!("PUT /api/label HTTP/1.1\r\nHost: {}\r\nCookie: {}\r\n", served.host(), served.cookie());
    let whole = format!("GET /nowhere HTTP/1.1\r\nHost: {}\r\nCookie: {}\r\n\r\n", served.host(), served.cookie());
    for (bytes, answers) in [
        (String::new(), vec![]),
        (head.clone(), vec![]),
        (format!("{head}Content-Length: 3\r\n\r\n{{"), vec![]),
        // A connection is also closed after a response, when another request might follow.
        (whole, vec![404]),
    ] {
        let start = Instant::now();
        assert_eq!(statuses(&served.exchange(bytes.as_bytes(), Then::StaySilent)), answers, "{bytes}");
        assert!(start.elapsed() >= Duration::from_millis(200), "closed after {:?}: {bytes}", start.elapsed());
    }
}

#[test]
fn requests_on_one_connection_are_kept_apart() {
    let served = Served::start();
    let host = format!("Host: {}\r\nCookie: {}\r\n", served.host(), served.cookie());
    let rename = "{\"label\": \"bracket\"}";
    let answer = served.exchange(
        format!(
            "PUT /api/label HTTP/1.1\r\n{host}Content-Length: {}\r\n\r\n{rename}\
             GET /nowhere HTTP/1.1\r\n{host}\r\nGET /api/session HTTP/1.1\r\n{host}Connection: close\r\n\r\n",
            rename.len()
        )
        .as_bytes(),
        Then::StaySilent,
    );
    assert_eq!(statuses(&answer), [200, 404, 200], "{answer}");
    assert!(answer.rsplit("HTTP/1.1 ").next().unwrap().contains("\"bracket\""), "{answer}");
}

#[test]
fn nothing_is_kept_open_after_a_refusal_and_after_http_1_0() {
    let served = Served::start();
    for (request, status) in [
        (format!("GET / HTTP/1.1\r\nHost: {}\r\n\r\n", served.host()), 401),
        (format!("GET /nowhere HTTP/1.0\r\nHost: {}\r\nCookie: {}\r\n\r\n", served.host(), served.cookie()), 404),
    ] {
        // The exchange ends before the server's timeout, or fails.
        let answer = served.exchange(request.as_bytes(), Then::StaySilent).replace("HTTP/1.0", "HTTP/1.1");
        assert_eq!(statuses(&answer), [status]);
    }
}

/// A server whose runtime has opened all files that it needs: one request was answered, its connection is closed.
#[cfg(unix)]
fn served_with_all_it_needs() -> Served {
    let served = Served::start();
    assert_eq!(served.ask("GET", "/api/session", b"").status, 200);
    std::thread::sleep(Duration::from_millis(300));
    served
}

/// Runs only as the child of [`a_page_outlives_a_lack_of_descriptors`], where few files may be open.
#[cfg(unix)]
#[test]
#[ignore = "needs few descriptors; another test runs it in a child process"]
fn child_with_few_descriptors() {
    let served = served_with_all_it_needs();
    let connect = || std::net::TcpStream::connect(served.host());
    // Client and server share the descriptors: the server lacks one for the connections that it has not accepted yet.
    let held: Vec<_> = std::iter::from_fn(|| connect().ok()).collect();
    assert!(held.len() > 2, "{}", held.len());
    std::thread::sleep(Duration::from_millis(500));
    drop(held);
    assert_eq!(served.ask("GET", "/api/session", b"").status, 200);
}

/// Like [`child_with_few_descriptors`], but no descriptor is ever released, because no connection is open.
#[cfg(unix)]
#[test]
#[ignore = "needs few descriptors; another test runs it in a child process"]
fn child_without_descriptors() {
    use std::io::Read;
    let served = served_with_all_it_needs();
    let mut files: Vec<_> = std::iter::from_fn(|| std::fs::File::open("/dev/null").ok()).collect();
    // One for the client, none for the server.
    files.pop();
    let mut client = std::net::TcpStream::connect(served.host()).unwrap();
    client.set_read_timeout(Some(Duration::from_secs(10))).unwrap();
    let ended = client.read(&mut [0]).map_err(|error| error.kind());
    assert!(matches!(ended, Ok(0) | Err(std::io::ErrorKind::ConnectionReset)), "{ended:?}");
}

#[cfg(unix)]
fn passes_with_few_descriptors(test: &str) {
    let output = std::process::Command::new("sh")
        .args(["-c", "ulimit -n 24; exec \"$0\" \"$@\""])
        .arg(std::env::current_exe().unwrap())
        .args(["--ignored", "--exact", test])
        .output()
        .unwrap();
    let printed = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success() && printed.contains("1 passed"), "{printed}");
}

#[cfg(unix)]
#[test]
fn a_page_outlives_a_lack_of_descriptors() {
    passes_with_few_descriptors("transport::child_with_few_descriptors");
}

#[cfg(unix)]
#[test]
fn a_page_that_can_never_answer_ends() {
    passes_with_few_descriptors("transport::child_without_descriptors");
}
