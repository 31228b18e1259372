//! Sends the requests of the annotation page, with the token in the header `Authorization`.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::process::ChildStdout;
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail, ensure};
use serde_json::{Value, json};

/// Longer than any request takes on a busy machine.
const TIMEOUT: Duration = Duration::from_secs(120);

/// A running page server.
#[derive(Debug, Clone)]
pub struct Page {
    address: String,
    token: String,
}

impl Page {
    /// Reads the page's address from the first line that `sdg annotate --json` prints.
    ///
    /// # Errors
    /// A program that ended or printed something else.
    pub fn of(printed: ChildStdout) -> Result<Self> {
        let mut line = String::new();
        BufReader::new(printed).read_line(&mut line)?;
        let line: Value =
            serde_json::from_str(&line).with_context(|| format!("expected an address, found {line:?}"))?;
        let url = line["url"].as_str().context("expected the field url")?;
        let (address, token) =
            url.strip_prefix("http://").and_then(|url| url.split_once("/?token=")).context("expected http://")?;
        Ok(Self { address: address.to_owned(), token: token.to_owned() })
    }

    /// Sends a request and returns the body of its answer.
    ///
    /// # Errors
    /// No connection, or an answer other than status 200.
    pub fn ask(&self, method: &str, path: &str, body: &[u8]) -> Result<Vec<u8>> {
        let mut stream = TcpStream::connect(&self.address)?;
        stream.set_read_timeout(Some(TIMEOUT))?;
        let (address, token, length) = (&self.address, &self.token, body.len());
        write!(
            stream,
            "{method} {path} HTTP/1.1\r\nHost: {address}\r\nAuthorization: Bearer {token}\r\nContent-Length: {length}\r\nConnection: close\r\n\r\n"
        )?;
        stream.write_all(body)?;
        let mut answer = Vec::new();
        stream.read_to_end(&mut answer)?;
        let end = answer.windows(4).position(|window| window == b"\r\n\r\n").context("expected a whole answer")?;
        let status = String::from_utf8_lossy(&answer[..end]).lines().next().unwrap_or_default().to_owned();
        let body = answer.split_off(end + 4);
        ensure!(status.contains(" 200 "), "{method} {path}: {status}: {}", String::from_utf8_lossy(&body));
        Ok(body)
    }

    /// Like [`Page::ask`], with an answer in JSON.
    ///
    /// # Errors
    /// The errors of [`Page::ask`]; an answer that is not JSON.
    pub fn json(&self, method: &str, path: &str, body: &[u8]) -> Result<Value> {
        Ok(serde_json::from_slice(&self.ask(method, path, body)?)?)
    }

    /// Does a user's session: opens the page, names the part, moves the grasp by half a pixel and back, adds a picture,
    /// teaches model S and tests it.
    ///
    /// # Errors
    /// A rejected request; failed teaching.
    pub fn mark_teach_and_try(&self, picture: &[u8]) -> Result<()> {
        self.ask("GET", "/", b"")?;
        let session = self.json("GET", "/api/session", b"")?;
        self.json("PUT", "/api/label", b"{\"label\": \"part\"}")?;
        let mut marks = session["images"][0]["marks"].clone();
        ensure!(marks.is_object(), "expected the marks of the photo in {session}");
        let x = marks["grasp"]["start"][0].as_f64().context("expected the marks' grasp")?;
        // There and back, so that a following session starts from the same grasp.
        for x in [x + 0.5, x] {
            marks["grasp"]["start"][0] = json!(x);
            self.json("PUT", "/api/images/0/marks", marks.to_string().as_bytes())?;
        }
        let tried = self.json("POST", "/api/trial-pictures?name=other.png", picture)?;
        self.json("POST", "/api/teaching", b"{\"model\": \"S\"}")?;
        let start = Instant::now();
        loop {
            let news = self.json("GET", "/api/teaching", b"")?;
            match news["status"].as_str() {
                Some("done") => break,
                Some("failed") => bail!("the teaching failed: {news}"),
                _ => ensure!(start.elapsed() < TIMEOUT, "the teaching does not end: {news}"),
            }
            thread::sleep(Duration::from_millis(50));
        }
        let id = &tried["id"];
        let found = self.json("POST", &format!("/api/trial-pictures/{id}/detect"), b"")?;
        ensure!(found["detections"].as_array().is_some_and(|found| !found.is_empty()), "found nothing: {found}");
        Ok(())
    }
}
