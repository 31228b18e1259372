//! Requests and their answers: JSON in, JSON out, errors as `{"error": "one line"}`.
//!
//! | request | does |
//! |---|---|
//! | `GET /`, `/page/{file}` | the page |
//! | `GET /api/session` | all that the page starts from |
//! | `PUT /api/label` | renames the object |
//! | `GET /api/images/{id}/picture` | a marked picture |
//! | `PUT /api/images/{id}/marks` | takes marks, writes them, says what they suffice for |
//! | `POST /api/images/{id}/outline` | proposes an outline from a box; null where nothing stands out |
//! | `GET /api/images/{id}/samples/{n}?seed=` | a sample of the marks, as JPEG |
//! | `GET`, `POST`, `DELETE /api/teaching` | news of the teaching; starts it; ends it with what there is |
//! | `POST /api/scenes?name=` | takes a picture to try |
//! | `GET /api/scenes/{id}/picture` | that picture |
//! | `POST /api/scenes/{id}/detect` | grasps in it |
//! | `POST /api/scenes/{id}/accept` | makes it a demonstration with the marks given |
//! | `GET /api/live` | the number of the camera's newest frame, and what is wrong with the camera |
//! | `GET /api/live/{number}/picture` | that frame, as JPEG |
//! | `POST /api/live/{number}/detect` | grasps in it |
//! | `POST /api/live/{number}/photo` | writes it as a photo of the part, to be marked |
//! | `POST /api/live/{number}/keep` | makes it a picture to try |

mod detections;
mod images;
mod live;
mod scenes;

use std::sync::Arc;

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::json;

use crate::error::{Error, Result};
use crate::http::{Request, Response};
use crate::page;
use crate::picture::MOST_PICTURE_BYTES;
use crate::session::Session;
use crate::teaching;
use crate::views::SessionView;

const JSON: &str = "application/json";
/// More than the marks of any hand; bounds what a request may make the server hold.
const MOST_JSON_BYTES: usize = 1 << 20;

/// How long the body of a request to `path` may be.
pub fn most_body_bytes(path: &str) -> usize {
    if path == "/api/scenes" { MOST_PICTURE_BYTES as usize } else { MOST_JSON_BYTES }
}

/// Answers a request that the guard has let pass.
pub fn answer(session: &Arc<Session>, request: &Request) -> Response {
    let head = &request.head;
    let no_such_address = || Response::plain(404, "there is nothing at this address\n");
    let Some(path) = head.path.strip_prefix('/') else { return no_such_address() };
    let path: Vec<&str> = path.split('/').collect();
    match (head.method.as_str(), path.as_slice()) {
        ("GET", [""]) => Response::new(200, "text/html; charset=utf-8", page::INDEX.as_bytes()),
        ("GET", ["page", name]) => match page::file(name) {
            Some((media_type, text)) => Response::new(200, media_type, text.as_bytes()),
            None => no_such_address(),
        },
        ("GET", ["api", "session"]) => json_of(Ok(session.view())),
        ("PUT", ["api", "label"]) => json_of(rename(session, &request.body)),
        ("GET", ["api", "teaching"]) => json_of(Ok(session.teaching.news())),
        ("POST", ["api", "teaching"]) => {
            json_of(read("teaching", &request.body).and_then(|asked| teaching::start(session, asked)))
        }
        ("DELETE", ["api", "teaching"]) => {
            session.teaching.stop();
            json_of(Ok(session.teaching.news()))
        }
        ("POST", ["api", "scenes"]) => json_of(scenes::add(session, request)),
        (method, ["api", "live", rest @ ..]) => live::answer(session, method, rest).unwrap_or_else(no_such_address),
        (method, ["api", kind @ ("images" | "scenes"), id, rest @ ..]) => {
            let Ok(id) = id.parse::<usize>() else { return no_such_address() };
            let answered = match *kind {
                "images" => images::answer(session, request, method, id, rest),
                _ => scenes::answer(session, request, method, id, rest),
            };
            answered.unwrap_or_else(no_such_address)
        }
        _ => no_such_address(),
    }
}

fn rename(session: &Session, body: &[u8]) -> Result<SessionView> {
    #[derive(Deserialize)]
    struct Rename {
        label: String,
    }
    let Rename { label } = read("label", body)?;
    session.set_label(&label)
}

/// The request's JSON.
fn read<T: DeserializeOwned>(what: &'static str, body: &[u8]) -> Result<T> {
    serde_json::from_slice(body).map_err(|error| Error::Request {
        what,
        expected: "JSON as the page sends it".into(),
        found: error.to_string(),
    })
}

/// The answer to what broke inside.
pub fn broken() -> Response {
    Response::new(500, JSON, json!({"error": "this failed inside; the terminal says more"}).to_string().into_bytes())
}

fn json_of<T: Serialize>(outcome: Result<T>) -> Response {
    match outcome.map(|value| serde_json::to_vec(&value)) {
        Ok(Ok(text)) => Response::new(200, JSON, text),
        Ok(Err(_)) => broken(),
        Err(error) => refusal(&error),
    }
}

fn picture_of(outcome: Result<(Vec<u8>, &'static str)>) -> Response {
    match outcome {
        Ok((bytes, media_type)) => Response::new(200, media_type, bytes),
        Err(error) => refusal(&error),
    }
}

fn refusal(error: &Error) -> Response {
    let status = match error {
        Error::NoSuchPicture { .. } | Error::NoSuchFrame { .. } | Error::NoCamera => 404,
        Error::Demonstration { .. } | Error::NotMarked { .. } | Error::Request { .. } | Error::Teacher(_) => 422,
        Error::Busy(_) | Error::NotTaught | Error::TooManyPictures { .. } | Error::Camera { .. } => 409,
        Error::TooLarge { .. } => 413,
        _ => 500,
    };
    Response::new(status, JSON, json!({"error": error.to_string()}).to_string().into_bytes())
}
