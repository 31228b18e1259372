//! Requests about marked pictures.

use sdg_demonstration::OutlineClicks;
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
    /// Places that belong to the part.
    #[serde(default)]
    inside: Vec<[f64; 2]>,
    /// Places that do not.
    #[serde(default)]
    outside: Vec<[f64; 2]>,
}

/// More clicks than any hand makes for one outline; each costs some milliseconds.
const MAX_CLICKS: usize = 200;

#[derive(Serialize)]
struct Proposal {
    outline: Option<Vec<[f64; 2]>>,
}

fn propose_outline(session: &Session, id: usize, body: &[u8]) -> Result<Proposal> {
    let BoxRequest { bbox: [x1, y1, x2, y2], inside, outside } = read("box", body)?;
    let found = inside.len() + outside.len();
    if found > MAX_CLICKS {
        return Err(Error::Request {
            what: "clicks",
            expected: format!("at most {MAX_CLICKS}"),
            found: found.to_string(),
        });
    }
    let picture = session.picture(id)?;
    let bbox = BoundingBox::new(x1, y1, x2, y2).map_err(|error| Error::Request {
        what: "box",
        expected: "two corners".into(),
        found: error.to_string(),
    })?;
    let places = |places: Vec<[f64; 2]>| places.into_iter().map(Into::into).collect();
    let clicks = OutlineClicks { inside: places(inside), outside: places(outside) };
    let outline = outline::propose(&picture.pixels()?, &bbox, &clicks);
    Ok(Proposal { outline: outline.map(|outline| outline.vertices.into_iter().map(Into::into).collect()) })
}
