//! Requests about the other pictures of a project's folder, and photos added on the page.

use super::answers::{json_of, picture_of};
use crate::error::Result;
use crate::http::{Request, Response};
use crate::session::Session;
use crate::views::ImageView;

/// Answers requests about picture `id`; `None` for an unknown address.
pub fn answer(session: &Session, method: &str, id: usize, rest: &[&str]) -> Option<Response> {
    Some(match (method, rest) {
        ("GET", ["picture"]) => picture_of(session.other_picture(id).and_then(|picture| picture.for_browser())),
        ("POST", ["photo"]) => json_of(session.add_photo(id)),
        ("POST", ["try"]) => json_of(session.add_other_trial(id)),
        _ => return None,
    })
}

/// Adds a photo from the page.
pub fn upload(session: &Session, request: &Request) -> Result<ImageView> {
    let name = request.head.query_value("name").unwrap_or_else(|| "photo".to_owned());
    session.upload_photo(&name, &request.body)
}
