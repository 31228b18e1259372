//! Serves a folder like a static host, on a port of this machine.

use std::io::{BufRead, BufReader, Write};
use std::net::{Ipv4Addr, SocketAddr, TcpListener, TcpStream};
use std::path::{Component, Path, PathBuf};

use crate::error::{Result, WebDriverError};

/// A folder that is served until the process ends.
#[derive(Debug)]
pub struct Site {
    address: SocketAddr,
}

impl Site {
    /// The address of a file.
    pub fn url(&self, file: &str) -> String {
        format!("http://{}/{file}", self.address)
    }
}

/// Serves the files of a folder.
///
/// # Errors
/// There is no such folder, or no free port.
pub fn serve_folder(folder: PathBuf) -> Result<Site> {
    if !folder.is_dir() {
        return Err(WebDriverError::NoFolder(folder));
    }
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).map_err(WebDriverError::io("a free port"))?;
    let address = listener.local_addr().map_err(WebDriverError::io("the port's number"))?;
    std::thread::spawn(move || {
        for stream in listener.incoming().flatten() {
            let folder = folder.clone();
            // A browser opens more connections than it uses; no connection may block another.
            std::thread::spawn(move || answer(&stream, &folder));
        }
    });
    Ok(Site { address })
}

/// Answers one request; a browser that has disconnected is not an error.
fn answer(mut stream: &TcpStream, folder: &Path) {
    let mut lines = BufReader::new(stream).lines().map_while(std::io::Result::ok);
    let request = lines.next().unwrap_or_default();
    lines.take_while(|line| !line.is_empty()).for_each(drop);
    let path = request.split(' ').nth(1).unwrap_or_default();
    let name = path.split('?').next().unwrap_or_default().trim_start_matches('/');
    let name = if name.is_empty() { "index.html" } else { name };
    let stays_inside = Path::new(name).components().all(|part| matches!(part, Component::Normal(_)));
    let file = if stays_inside { std::fs::read(folder.join(name)).ok() } else { None };
    let (status, body) = match file {
        Some(body) => ("200 OK", body),
        None => ("404 Not Found", b"no such file".to_vec()),
    };
    let head = format!(
        "HTTP/1.1 {status}\r\nContent-Type: {}\r\nContent-Length: {}\r\nConnection: close\r\n\r\n",
        media_type(name),
        body.len()
    );
    let _ = stream.write_all(head.as_bytes()).and_then(|()| stream.write_all(&body));
}

fn media_type(name: &str) -> &'static str {
    match Path::new(name).extension().and_then(|extension| extension.to_str()) {
        Some("html") => "text/html; charset=utf-8",
        Some("css") => "text/css",
        Some("js" | "mjs") => "text/javascript",
        Some("wasm") => "application/wasm",
        // Browsers show an SVG drawing only with its type; they recognise other pictures by their
        // bytes.
        Some("svg") => "image/svg+xml",
        _ => "application/octet-stream",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::http;

    #[test]
    fn files_of_the_folder_are_served_and_no_others() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("index.html"), "hello").unwrap();
        std::fs::create_dir(folder.path().join("inner")).unwrap();
        std::fs::write(folder.path().join("inner/page.html"), "inside").unwrap();
        let site = serve_folder(folder.path().to_owned()).unwrap();
        let get = |path: &str| http::request(site.address, "GET", path, None).unwrap();
        assert_eq!(get("/"), (200, "hello".to_owned()));
        assert_eq!(get("/index.html?again"), (200, "hello".to_owned()));
        assert_eq!(get("/inner/page.html"), (200, "inside".to_owned()));
        assert_eq!(get("/other.html").0, 404);
        assert_eq!(get("/../../etc/passwd").0, 404);
        assert_eq!(get("/inner/../../../etc/passwd").0, 404);
        assert_eq!(get("/inner").0, 404);
    }

    #[test]
    fn a_missing_folder_is_an_error() {
        assert!(serve_folder("/nowhere/at/all".into()).unwrap_err().to_string().contains("expected a folder"));
    }
}
