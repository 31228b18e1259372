//! Requests about marked pictures.

use sdg_demonstration::OutlineClick;
use sdg_geometry::BoundingBox;
use serde::{Deserialize, Serialize};

use super::answers::{json_of, picture_of, read};
use crate::error::{Error, Result};
use crate::http::{Request, Response};
use crate::outline;
use crate::session::Session;

/// Answers what is asked of picture `id`; `None` where there is no such address.
pub fn answer(session: &Session, request: &Request, method: &str, id: usize, rest: &[&str]) -> Option<Response> {
    let body = &request.body;
    Some(match (method, rest) {
        ("GET", ["picture"]) => picture_of(session.picture(id).and_then(|picture| picture.for_browser())),
        ("PUT", ["marks"]) => json_of(read("marks", body).and_then(|marks| session.set_marks(id, marks))),
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
    /// In the order in which they were made.
    #[serde(default)]
    clicks: Vec<ClickRequest>,
}

#[derive(Deserialize)]
struct ClickRequest {
    at: [f64; 2],
    /// Whether the place belongs to the part.
    is_inside: bool,
}

/// More clicks than any hand makes for one outline; each costs some milliseconds.
const MAX_CLICKS: usize = 100;

#[derive(Serialize)]
struct Proposal {
    outline: Option<Vec<[f64; 2]>>,
}

fn propose_outline(session: &Session, id: usize, body: &[u8]) -> Result<Proposal> {
    let BoxRequest { bbox: [x1, y1, x2, y2], clicks } = read("box", body)?;
    if clicks.len() > MAX_CLICKS {
        return Err(Error::Request {
            what: "clicks",
            expected: format!("at most {MAX_CLICKS}"),
            found: clicks.len().to_string(),
        });
    }
    let picture = session.picture(id)?;
    let bbox = BoundingBox::new(x1, y1, x2, y2).map_err(|error| Error::Request {
        what: "box",
        expected: "two corners".into(),
        found: error.to_string(),
    })?;
    let of = |ClickRequest { at, is_inside }| OutlineClick { at: at.into(), is_inside };
    let clicks: Vec<_> = clicks.into_iter().map(of).collect();
    let outline = outline::propose(&picture.pixels()?, &bbox, &clicks);
    Ok(Proposal { outline: outline.map(|outline| outline.vertices.into_iter().map(Into::into).collect()) })
}
