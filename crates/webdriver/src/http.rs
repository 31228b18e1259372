//! The subset of HTTP that a local ChromeDriver needs: one request, one response, one connection.

use std::io::{self, BufRead, BufReader, Write};
use std::net::{SocketAddr, TcpStream};
use std::time::Duration;

/// Timeout for a response: the slowest command may teach a model in the page.
const LONGEST_ANSWER: Duration = Duration::from_secs(600);

/// Sends a request and returns status and body.
pub(crate) fn request(driver: SocketAddr, method: &str, path: &str, body: Option<&str>) -> io::Result<(u16, String)> {
    let mut stream = TcpStream::connect_timeout(&driver, Duration::from_secs(5))?;
    stream.set_read_timeout(Some(LONGEST_ANSWER))?;
    let body = body.unwrap_or_default();
    // In a single write: after a head in its own packet, the body would wait until the head is acknowledged.
    let request = format!(
        "{method} {path} HTTP/1.1\r\nHost: {driver}\r\nContent-Type: application/json\r\nContent-Length: {}\r\n\
         Connection: close\r\n\r\n{body}",
        body.len()
    );
    stream.write_all(request.as_bytes())?;
    read_answer(&mut BufReader::new(stream))
}

/// Reads only the number of bytes announced in the head, because the driver may keep the
/// connection open.
fn read_answer(stream: &mut impl BufRead) -> io::Result<(u16, String)> {
    let invalid = || io::Error::new(io::ErrorKind::InvalidData, "expected an HTTP answer");
    let mut line = String::new();
    stream.read_line(&mut line)?;
    let status = line.strip_prefix("HTTP/1.").and_then(|rest| rest.split_whitespace().nth(1)).ok_or_else(invalid)?;
    let status = status.parse().map_err(|_| invalid())?;
    let mut length = None;
    loop {
        line.clear();
        stream.read_line(&mut line)?;
        match line.trim_end().split_once(':') {
            Some((name, value)) if name.eq_ignore_ascii_case("content-length") => length = value.trim().parse().ok(),
            Some(_) => {}
            None => break, // The empty line that ends the head.
        }
    }
    let mut body = vec![0; length.ok_or_else(invalid)?];
    stream.read_exact(&mut body)?;
    Ok((status, String::from_utf8_lossy(&body).into_owned()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_answer_is_a_status_and_a_body() {
        let mut answer = &b"HTTP/1.1 404 Not Found\r\nContent-Length: 2\r\n\r\n{}and what follows"[..];
        assert_eq!(read_answer(&mut answer).unwrap(), (404, "{}".to_owned()));
        assert!(read_answer(&mut &b"SSH-2.0-OpenSSH\r\n"[..]).is_err());
        assert!(read_answer(&mut &b"HTTP/1.1 200 OK\r\nContent-Length: 9\r\n\r\ncut"[..]).is_err());
    }
}
