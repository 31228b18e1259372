//! Cameras over HTTP/1.1: motion JPEG as `multipart/x-mixed-replace`, and single pictures that are fetched again and again.
//!
//! ```text
//! Url ── exchange: connect, request, head, redirects ── Body: framing ─┬─ Multipart ── MotionJpeg   (one connection)
//!                                                                      └─ one picture ── Snapshots  (a connection each)
//! ```
//! A minimal HTTP client: cameras need no more, and everything that a server can send is bounded in memory and in time.
//! Absent: TLS, compression, cookies, proxies, keep-alive between snapshots.

mod body;
mod exchange;
mod motion_jpeg;
mod multipart;
mod snapshots;
mod url;
mod waiting;

use std::time::Instant;

use crate::error::CameraError;
use crate::options::OpenOptions;
use crate::source::Source;

pub use url::Url;

/// Sends a request and determines from the response which of the two kinds the server is.
pub(crate) fn connect(url: &Url, options: &OpenOptions, deadline: Instant) -> Result<Box<dyn Source>, CameraError> {
    let refused = |why: String| CameraError::Open { address: url.to_string(), why };
    let mut login = exchange::Login::default();
    let answer = exchange::get(url, &mut login, deadline).map_err(refused)?;
    let kind = answer.content_type.split(';').next().unwrap_or_default().trim().to_ascii_lowercase();
    match kind.as_str() {
        "image/jpeg" | "image/jpg" | "image/png" => {
            Ok(Box::new(snapshots::Snapshots::new(url.clone(), login, answer, options)))
        }
        _ if kind.starts_with("multipart/") => {
            let source =
                motion_jpeg::MotionJpeg::new(&answer.content_type, answer.body, options.frame).map_err(refused)?;
            Ok(Box::new(source))
        }
        _ => Err(refused(format!(
            "expected pictures (multipart/x-mixed-replace, image/jpeg or image/png), found {}; the address of a camera's page is \
             not that of its pictures",
            if kind.is_empty() { "no content type" } else { &kind }
        ))),
    }
}
