//! Requests and their answers: JSON in, JSON or a picture out, most errors as `{"error": "one line"}`.
//!
//! Pictures have numbers, which are valid for one session. A request with the header `Sdg-Session` is answered only if
//! its value is the id in `GET /api/session`, otherwise with 412: a page of an earlier server must not change another
//! picture.
//!
//! | request | does |
//! |---|---|
//! | `GET /`, `/page/{file}` | the page |
//! | `GET /api/session` | the data with which the page starts; `{"start": …}` if no project is open |
//! | `POST /api/projects?name=&photo=` | creates a project with this name and photo, and opens it |
//! | `POST /api/projects/{id}/open` | opens a project listed in `start` |
//! | `DELETE /api/projects` | closes the open project |
//! | `GET /api/others/{id}/picture` | another picture of the project's folder |
//! | `POST /api/others/{id}/photo`, `/api/others/{id}/try` | makes the picture a photo of the part, or a picture to try |
//! | `POST /api/images?name=` | adds a photo of the part |
//! | `PUT /api/label` | renames the object |
//! | `PUT /api/region` | sets the searched region; null for the whole picture |
//! | `GET /api/images/{id}/picture` | a marked picture |
//! | `PUT /api/images/{id}/marks` | stores and writes marks; returns the result of checking them; a refusal because another program changed them has the photo with its new marks as `image` |
//! | `DELETE /api/images/{id}`, `/api/trial-pictures/{id}` | removes the picture from the session; its file is kept |
//! | `POST /api/images/{id}/put-back`, `/api/trial-pictures/{id}/put-back` | restores a removed picture |
//! | `POST /api/images/{id}/outline` | proposes an outline from a box, or corrects one, with strokes; null if nothing differs from its surroundings |
//! | `GET /api/images/{id}/samples/{n}?seed=` | a sample of the marks, as JPEG |
//! | `GET`, `POST`, `DELETE /api/teaching` | progress of the teaching; starts it; ends it with its current result |
//! | `POST /api/trial-pictures?name=` | adds a picture to try |
//! | `GET /api/trial-pictures/{id}/picture` | a picture to try |
//! | `POST /api/trial-pictures/{id}/detect` | grasps in the picture |
//! | `POST /api/trial-pictures/{id}/accept` | makes the picture a demonstration with its own marks or, if only these have a grasp, the given ones |
//! | `POST /api/trial-pictures/{id}/would-help` | best scores of model S in other pictures, if the picture were a photo of the part |
//! | `PUT /api/trial-pictures/{id}/absent` | states that the part is not in the picture, or revokes the statement |
//! | `PUT /api/models/{id}/current` | uses a version of the model from `GET /api/session` |
//! | `POST /api/models/{id}/compare/{other}` | detections of two versions in the pictures to try |
//! | `GET /api/live` | the number of the camera's newest frame, and the camera's fault |
//! | `GET /api/live/{number}/picture` | a frame that was shown, as JPEG |
//! | `POST /api/live/{number}/detect` | grasps in the frame |
//! | `POST /api/live/{number}/hold` | keeps the frame while later ones are shown, for a page that pauses |
//! | `POST /api/live/{number}/photo` | writes the frame as a photo of the part |
//! | `POST /api/live/{number}/keep` | makes the frame a picture to try |

mod answers;
mod detections;
mod images;
mod live;
mod models;
mod others;
mod projects;
mod trial_pictures;

use serde::Deserialize;

pub use answers::broken;
use answers::{json_of, read};

use crate::desk::Desk;
use crate::error::Result;
use crate::http::{Request, Response};
use crate::page;
use crate::picture::MAX_PICTURE_BYTES;
use crate::session::Session;
use crate::views::SessionView;

/// Maximum size of a JSON body; bounds the memory that a request can use.
const MAX_JSON_BYTES: usize = 1 << 20;

/// Header with the session to which the numbers in a request belong.
const SESSION_HEADER: &str = "sdg-session";

/// Maximum size of the body of a request to `path`.
pub fn max_body_bytes(path: &str) -> usize {
    let takes_picture = ["/api/trial-pictures", "/api/images", "/api/projects"].contains(&path);
    if takes_picture { MAX_PICTURE_BYTES as usize } else { MAX_JSON_BYTES }
}

/// Answers a request that has passed the guard.
pub fn answer(desk: &Desk, request: &Request) -> Response {
    let head = &request.head;
    let session = desk.session();
    if head.all(SESSION_HEADER).any(|id| session.as_ref().is_none_or(|session| id != session.id())) {
        return Response::plain(412, "the pictures' numbers are those of another session\n");
    }
    let Some(path) = head.path.strip_prefix('/') else { return no_such_address() };
    let path: Vec<&str> = path.split('/').collect();
    match (head.method.as_str(), path.as_slice()) {
        ("GET", [""]) => Response::new(200, "text/html; charset=utf-8", page::index().into_bytes()),
        ("GET", ["page", name]) => match page::file(name) {
            Some((media_type, text)) => Response::new(200, media_type, text.into_bytes()),
            None => no_such_address(),
        },
        ("GET", ["api", "session"]) => json_of(desk.view()),
        (_, ["api", "projects", rest @ ..]) => projects::answer(desk, request, rest).unwrap_or_else(no_such_address),
        (_, path) => match session {
            Some(session) => of_session(&session, request, path),
            None => Response::plain(409, "no project is open yet\n"),
        },
    }
}

fn no_such_address() -> Response {
    Response::plain(404, "there is nothing at this address\n")
}

fn of_session(session: &Session, request: &Request, path: &[&str]) -> Response {
    match (request.head.method.as_str(), path) {
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
        ("POST", ["api", "images"]) => json_of(others::upload(session, request)),
        (method, ["api", kind @ ("images" | "trial-pictures" | "others"), id, rest @ ..]) => {
            let Ok(id) = id.parse::<usize>() else { return no_such_address() };
            let answered = match *kind {
                "images" => images::answer(session, request, method, id, rest),
                "others" => others::answer(session, method, id, rest),
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
