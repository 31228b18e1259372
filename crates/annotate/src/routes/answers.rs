//! JSON bodies of requests, and responses shared by all addresses.

use sdg_files::FileError;
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::{Value, json};

use crate::error::{Error, Result};
use crate::http::Response;

const JSON: &str = "application/json";

/// Reads the request's JSON body.
pub fn read<T: DeserializeOwned>(what: &'static str, body: &[u8]) -> Result<T> {
    serde_json::from_slice(body).map_err(|error| Error::Request {
        what,
        expected: "JSON as the page sends it".into(),
        found: error.to_string(),
    })
}

/// The response to an internal error.
pub fn broken() -> Response {
    Response::new(500, JSON, json!({"error": "internal error; the terminal says more"}).to_string().into_bytes())
}

pub fn json_of<T: Serialize>(outcome: Result<T>) -> Response {
    match outcome.map(|value| serde_json::to_vec(&value)) {
        Ok(Ok(text)) => Response::new(200, JSON, text),
        Ok(Err(_)) => broken(),
        Err(error) => refusal(&error),
    }
}

pub fn picture_of(outcome: Result<(Vec<u8>, &'static str)>) -> Response {
    match outcome {
        Ok((bytes, media_type)) => Response::new(200, media_type, bytes),
        Err(error) => refusal(&error),
    }
}

fn refusal(error: &Error) -> Response {
    refusal_with(error, json!({}))
}

/// The response to an error, with further members of its JSON object.
pub fn refusal_with(error: &Error, mut body: Value) -> Response {
    let status = match error {
        Error::NoSuchPicture { .. } | Error::NoSuchVersion { .. } | Error::NoSuchFrame { .. } | Error::NoCamera => 404,
        Error::Demonstration { .. }
        | Error::NotMarked { .. }
        | Error::SharedMarks { .. }
        | Error::OtherSize { .. }
        | Error::Request { .. }
        | Error::Teacher(_) => 422,
        Error::Busy(_)
        | Error::MarksChanged
        | Error::NotTaught
        | Error::TooManyPictures { .. }
        | Error::Camera { .. }
        | Error::Write(FileError::Held { .. }) => 409,
        Error::TooLarge { .. } => 413,
        _ => 500,
    };
    body["error"] = error.to_string().into();
    Response::new(status, JSON, body.to_string().into_bytes())
}
