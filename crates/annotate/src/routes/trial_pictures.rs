//! Requests about pictures that a taught model is tried on.

use serde::Deserialize;

use super::answers::{json_of, picture_of, read};
use super::detections::{Explained, detect};
use crate::error::Result;
use crate::http::{Request, Response};
use crate::session::Session;
use crate::views::TrialPictureView;

/// Answers requests about picture `id`; `None` for an unknown address.
pub fn answer(session: &Session, request: &Request, method: &str, id: usize, rest: &[&str]) -> Option<Response> {
    Some(match (method, rest) {
        ("GET", ["picture"]) => picture_of(session.trial_picture(id).and_then(|trial| trial.picture.for_browser())),
        ("POST", ["detect"]) => {
            let pixels = session.trial_picture(id).and_then(|trial| trial.picture.pixels());
            json_of(pixels.and_then(|pixels| detect(session, &pixels, Explained::WithPlaces)))
        }
        ("POST", ["accept"]) => json_of(read("marks", &request.body).and_then(|marks| session.accept(id, marks))),
        ("POST", ["would-help"]) => {
            json_of(read("question", &request.body).and_then(|question| session.would_help(id, question)))
        }
        ("PUT", ["absent"]) => {
            json_of(read("absent", &request.body).and_then(|Absent { absent }| session.set_absent(id, absent)))
        }
        ("POST", ["put-back"]) => json_of(session.put_back_trial_picture(id).map(|()| session.view())),
        ("DELETE", []) => json_of(session.remove_trial_picture(id).map(|()| session.view())),
        _ => return None,
    })
}

/// Whether the user states that the part is not in the picture.
#[derive(Deserialize)]
struct Absent {
    absent: bool,
}

/// Adds a picture from the page.
pub fn add(session: &Session, request: &Request) -> Result<TrialPictureView> {
    let name = request.head.query_value("name").unwrap_or_else(|| "picture".to_owned());
    session.add_trial_picture(&name, &request.body)
}
