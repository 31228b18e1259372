//! Requests about pictures that a taught model is tried on.

use std::time::Instant;

use serde::Serialize;

use super::{json_of, picture_of, read};
use crate::error::{Error, Result};
use crate::http::{Request, Response};
use crate::marks::Marks;
use crate::session::Session;
use crate::teacher::FoundGrasp;
use crate::views::SceneView;

/// Answers what is asked of picture `id`; `None` where there is no such address.
pub fn answer(session: &Session, request: &Request, method: &str, id: usize, rest: &[&str]) -> Option<Response> {
    Some(match (method, rest) {
        ("GET", ["picture"]) => picture_of(session.scene(id).and_then(|scene| scene.picture.for_browser())),
        ("POST", ["detect"]) => json_of(detect(session, id)),
        ("POST", ["accept"]) => json_of(read("marks", &request.body).and_then(|marks| session.accept(id, marks))),
        _ => return None,
    })
}

/// Takes a picture from the page.
pub fn add(session: &Session, request: &Request) -> Result<SceneView> {
    let name = request.head.query_value("name").unwrap_or_else(|| "picture".to_owned());
    session.add_scene(&name, &request.body)
}

/// A detection as the page draws it; `marks` are what accepting it would mark.
#[derive(Serialize)]
struct DetectionView {
    score: f64,
    is_accepted: bool,
    marks: Marks,
}

#[derive(Serialize)]
struct DetectionsView {
    seconds: f64,
    detections: Vec<DetectionView>,
}

fn detect(session: &Session, id: usize) -> Result<DetectionsView> {
    let picture = session.scene(id)?.picture;
    let model = session.teaching.model()?;
    let pixels = picture.pixels()?;
    let start = Instant::now();
    let found = model.detect(&pixels).map_err(Error::Teacher)?;
    let seconds = start.elapsed().as_secs_f64();
    let view = |found: &FoundGrasp| DetectionView {
        score: found.score,
        is_accepted: found.is_accepted,
        marks: Marks::of_found(found, picture.size),
    };
    Ok(DetectionsView { seconds, detections: found.iter().map(view).collect() })
}
