//! Requests and their answers: JSON in, JSON out, errors as `{"error": "one line"}`.
//!
//! Pictures are known by numbers, which hold for one session. A request with the header `Sdg-Session` is answered only where that
//! is the id in `GET /api/session`, with 412 otherwise: a page that outlived its server must not change another picture.
//!
//! | request | does |
//! |---|---|
//! | `GET /`, `/page/{file}` | the page |
//! | `GET /api/session` | all that the page starts from |
//! | `PUT /api/label` | renames the object |
//! | `PUT /api/region` | the part of pictures that is searched from now on; null for all of them |
//! | `GET /api/images/{id}/picture` | a marked picture |
//! | `PUT /api/images/{id}/marks` | takes marks, writes them, says what they suffice for |
//! | `DELETE /api/images/{id}`, `/api/trial-pictures/{id}` | takes the picture out of the session; its file stays |
//! | `POST /api/images/{id}/outline` | proposes an outline from a box and places that belong to the part or do not; null where nothing stands out |
//! | `GET /api/images/{id}/samples/{n}?seed=` | a sample of the marks, as JPEG |
//! | `GET`, `POST`, `DELETE /api/teaching` | news of the teaching; starts it; ends it with what there is |
//! | `POST /api/trial-pictures?name=` | takes a picture to try |
//! | `GET /api/trial-pictures/{id}/picture` | that picture |
//! | `POST /api/trial-pictures/{id}/detect` | grasps in it |
//! | `POST /api/trial-pictures/{id}/accept` | makes it a demonstration with the marks given |
//! | `PUT /api/trial-pictures/{id}/absent` | says that the part is not there, or takes that back |
//! | `PUT /api/models/{id}/current` | uses a version of the model, of those in `GET /api/session` |
//! | `POST /api/models/{id}/compare/{other}` | what two versions find in the pictures to try |
//! | `GET /api/live` | the number of the camera's newest frame, and what is wrong with the camera |
//! | `GET /api/live/{number}/picture` | that frame, as JPEG |
//! | `POST /api/live/{number}/detect` | grasps in it |
//! | `POST /api/live/{number}/photo` | writes it as a photo of the part, to be marked |
//! | `POST /api/live/{number}/keep` | makes it a picture to try |

mod answers;
mod detections;
mod images;
mod live;
mod models;
mod trial_pictures;

use serde::Deserialize;

pub use answers::broken;
use answers::{json_of, read};

use crate::error::Result;
use crate::http::{Request, Response};
use crate::page;
use crate::picture::MAX_PICTURE_BYTES;
use crate::session::Session;
use crate::views::SessionView;

/// More than the marks of any hand; bounds what a request may make the server hold.
const MAX_JSON_BYTES: usize = 1 << 20;

/// Names the session that the numbers in a request belong to.
const SESSION_HEADER: &str = "sdg-session";

/// How long the body of a request to `path` may be.
pub fn max_body_bytes(path: &str) -> usize {
    if path == "/api/trial-pictures" { MAX_PICTURE_BYTES as usize } else { MAX_JSON_BYTES }
}

/// Answers a request that the guard has let pass.
pub fn answer(session: &Session, request: &Request) -> Response {
    let head = &request.head;
    let no_such_address = || Response::plain(404, "there is nothing at this address\n");
    if head.all(SESSION_HEADER).any(|id| id != session.id()) {
        return Response::plain(412, "the pictures' numbers are those of another session\n");
    }
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
        ("PUT", ["api", "region"]) => json_of(
            read("region", &request.body).and_then(|region| session.set_region(region)).map(|()| session.view()),
        ),
        ("GET", ["api", "teaching"]) => json_of(Ok(session.teaching_news())),
        ("POST", ["api", "teaching"]) => {
            json_of(read("teaching", &request.body).and_then(|asked| session.start_teaching(asked)))
        }
        ("DELETE", ["api", "teaching"]) => {
            session.stop_teaching();
            json_of(Ok(session.teaching_news()))
        }
        ("POST", ["api", "trial-pictures"]) => json_of(trial_pictures::add(session, request)),
        (method, ["api", "models", id, rest @ ..]) => {
            models::answer(session, method, id, rest).unwrap_or_else(no_such_address)
        }
        (method, ["api", "live", rest @ ..]) => live::answer(session, method, rest).unwrap_or_else(no_such_address),
        (method, ["api", kind @ ("images" | "trial-pictures"), id, rest @ ..]) => {
            let Ok(id) = id.parse::<usize>() else { return no_such_address() };
            let answered = match *kind {
                "images" => images::answer(session, request, method, id, rest),
                _ => trial_pictures::answer(session, request, method, id, rest),
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
