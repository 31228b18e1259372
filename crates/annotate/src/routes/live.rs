//! Requests about the camera's live pictures.

use serde::Serialize;

use super::answers::{json_of, picture_of};
use super::detections::{Explained, detect};
use crate::error::Result;
use crate::http::Response;
use crate::live::{Live, LiveFault};
use crate::names::file_name;
use crate::picture::jpeg;
use crate::session::Session;

/// Answers requests about the camera; `None` for an unknown address.
pub fn answer(session: &Session, method: &str, rest: &[&str]) -> Option<Response> {
    if let ("GET", []) = (method, rest) {
        return Some(json_of(state(session)));
    }
    let [number, action] = rest else { return None };
    let number = number.parse::<u64>().ok()?;
    Some(match (method, *action) {
        ("GET", "picture") => picture_of(
            session.live_desk().and_then(|desk| desk.frame(number)).map(|picture| (jpeg(&picture), "image/jpeg")),
        ),
        ("POST", "detect") => json_of(
            session
                .live_desk()
                .and_then(|desk| desk.frame(number))
                .and_then(|picture| detect(session, &picture, Explained::InWords)),
        ),
        ("POST", "hold") => json_of(session.live_desk().and_then(|desk| desk.hold(number))),
        ("POST", "photo") => json_of(session.take_photo(number)),
        ("POST", "keep") => json_of(session.keep_frame(number)),
        _ => return None,
    })
}

/// The newest frame, and the camera's state.
#[derive(Serialize)]
struct LiveView {
    frame: Option<FrameView>,
    fault: Option<LiveFault>,
    /// Whether a photo can be taken now.
    is_usable: bool,
    /// File name of the next photo.
    next_photo: String,
}

#[derive(Serialize)]
struct FrameView {
    number: u64,
    width: u32,
    height: u32,
    age_secs: f64,
}

fn state(session: &Session) -> Result<LiveView> {
    let Live { frame, fault } = session.live_desk()?.newest();
    let is_usable = frame.is_some() && fault.as_ref().is_none_or(|fault| fault.kind.is_usable());
    let frame = frame.map(|frame| FrameView {
        number: frame.number,
        width: frame.picture.width(),
        height: frame.picture.height(),
        age_secs: frame.age.as_secs_f64(),
    });
    Ok(LiveView { frame, fault, is_usable, next_photo: file_name(&session.next_photo()?) })
}
