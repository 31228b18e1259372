//! Cameras over HTTP/1.1: motion JPEG as `multipart/x-mixed-replace`, and single pictures that are requested
//! repeatedly.
//!
//! ```text
//! Url ── exchange: connect, request, head, redirects ── Body: framing ─┬─ Multipart ── MotionJpeg   (one connection)
//!                                                                      └─ one picture ── Snapshots  (a connection each)
//! ```
//! A minimal HTTP client, sufficient for cameras; the memory and the time that a server's data can take are bounded.
//! Not supported: TLS, compression, cookies, proxies, keep-alive between snapshots.

mod body;
mod exchange;
mod motion_jpeg;
mod multipart;
mod snapshots;
mod url;
mod waiting;

use std::time::{Duration, Instant, SystemTime};

use image::RgbImage;

use crate::error::CameraError;
use crate::options::OpenOptions;
use crate::source::{Missing, Source};

pub use url::{Url, without_password};

/// Sends a request, and determines from the response whether the server sends motion JPEG or single pictures.
pub(crate) fn connect(url: &Url, options: &OpenOptions, deadline: Instant) -> Result<Box<dyn Source>, CameraError> {
    let refused = |why: String| CameraError::Open { address: url.to_string(), why };
    let mut login = exchange::Login::default();
    let asked = SystemTime::now();
    let answer = exchange::get(url, &mut login, deadline).map_err(refused)?;
    let kind = answer.content_type.split(';').next().unwrap_or_default().trim().to_ascii_lowercase();
    match kind.as_str() {
        "image/jpeg" | "image/jpg" | "image/png" => {
            Ok(Box::new(snapshots::Snapshots::new(url.clone(), login, (asked, answer), options)))
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

/// The first pictures of a server. Torn pictures count towards `max_pictures`, but are not returned. Unlike a
/// [`Camera`](crate::Camera), this function does not reconnect: it returns when the connection is lost or no picture
/// arrives within `timeout`. It is meant for tests of servers and of the client.
///
/// # Errors
/// [`CameraError::Open`] if the server's first response is not a camera's.
pub fn read_pictures(
    url: &Url,
    options: &OpenOptions,
    timeout: Duration,
    max_pictures: usize,
) -> Result<Vec<RgbImage>, CameraError> {
    let mut source = connect(url, options, Instant::now() + timeout)?;
    let mut pictures = Vec::new();
    let mut num_torn = 0;
    while pictures.len() + num_torn < max_pictures {
        match source.take(Instant::now() + timeout) {
            Ok(Some(taken)) => pictures.push(taken.picture),
            Err(Missing::Torn(_)) => num_torn += 1,
            Ok(None) | Err(Missing::Late | Missing::Gone(_) | Missing::Ended(_)) => break,
        }
    }
    Ok(pictures)
}
