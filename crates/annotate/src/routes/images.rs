//! Requests about marked pictures.

use sdg_demonstration::OutlineStroke;
use sdg_geometry::{BoundingBox, Polygon};
use serde::{Deserialize, Serialize};
use serde_json::json;

use super::answers::{json_of, picture_of, read, refusal_with};
use crate::error::{Error, Result};
use crate::http::{Request, Response};
use crate::outline;
use crate::session::Session;

/// Answers requests about picture `id`; `None` for an unknown address.
pub fn answer(session: &Session, request: &Request, method: &str, id: usize, rest: &[&str]) -> Option<Response> {
    let body = &request.body;
    Some(match (method, rest) {
        ("GET", ["picture"]) => picture_of(session.picture(id).and_then(|picture| picture.for_browser())),
        ("PUT", ["marks"]) => match read("marks", body).and_then(|marks| session.set_marks(id, marks)) {
            // The page adopts the marks of the file; otherwise its next change would replace them.
            Err(error @ Error::MarksChanged) => match session.image_view(id) {
                Ok(image) => refusal_with(&error, json!({ "image": image })),
                Err(error) => json_of::<()>(Err(error)),
            },
            outcome => json_of(outcome),
        },
        ("DELETE", []) => json_of(session.remove_image(id).map(|()| session.view())),
        ("POST", ["put-back"]) => json_of(session.put_back_image(id).map(|()| session.view())),
        ("POST", ["outline"]) => json_of(propose_outline(session, id, body)),
        ("GET", ["samples", index]) => {
            let seed = request.head.query_value("seed").and_then(|seed| seed.parse().ok()).unwrap_or(1);
            let index = index.parse::<u64>().ok()?;
            picture_of(session.sample(id, seed, index).map(|bytes| (bytes, "image/jpeg")))
        }
        _ => return None,
    })
}

#[derive(Deserialize)]
struct BoxRequest {
    #[serde(rename = "box")]
    bbox: [f64; 4],
    /// Strokes in the order in which they were drawn.
    #[serde(default)]
    strokes: Vec<StrokeRequest>,
    /// The outline that the strokes correct; without one, it is detected in the box.
    #[serde(default)]
    outline: Option<Vec<[f64; 2]>>,
}

#[derive(Deserialize)]
struct StrokeRequest {
    /// A single point for a click.
    points: Vec<[f64; 2]>,
    /// Whether the stroke marks the part or its surroundings.
    is_inside: bool,
}

/// Maximum number of strokes of an outline; each costs some milliseconds.
const MAX_STROKES: usize = 100;
/// Maximum number of points of a stroke; the page sends fewer.
const MAX_POINTS: usize = 1000;

#[derive(Serialize)]
struct Proposal {
    outline: Option<Vec<[f64; 2]>>,
}

fn propose_outline(session: &Session, id: usize, body: &[u8]) -> Result<Proposal> {
    let BoxRequest { bbox: [x1, y1, x2, y2], strokes, outline } = read("box", body)?;
    let most = strokes.iter().map(|stroke| stroke.points.len()).max().unwrap_or(0);
    if strokes.len() > MAX_STROKES || most > MAX_POINTS {
        return Err(Error::Request {
            what: "strokes",
            expected: format!("at most {MAX_STROKES} of at most {MAX_POINTS} points"),
            found: format!("{}, the longest of {most}", strokes.len()),
        });
    }
    let picture = session.picture(id)?;
    let bbox = BoundingBox::new(x1, y1, x2, y2).map_err(|error| Error::Request {
        what: "box",
        expected: "two corners".into(),
        found: error.to_string(),
    })?;
    let of = |StrokeRequest { points, is_inside }| OutlineStroke {
        points: points.into_iter().map(Into::into).collect(),
        is_inside,
    };
    let strokes: Vec<_> = strokes.into_iter().map(of).collect();
    let known = outline.map(|points| Polygon::new(points.into_iter().map(Into::into).collect()));
    let known = known.transpose().map_err(|error| Error::Request {
        what: "outline",
        expected: "a polygon".into(),
        found: error.to_string(),
    })?;
    let outline = outline::propose(&picture.pixels()?, &bbox, known.as_ref(), &strokes);
    Ok(Proposal { outline: outline.map(|outline| outline.vertices.into_iter().map(Into::into).collect()) })
}
