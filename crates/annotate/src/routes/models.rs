//! Requests about the versions of the model.

use super::answers::json_of;
use crate::http::Response;
use crate::session::Session;

/// Answers requests about version `id`; `None` for an unknown address.
pub fn answer(session: &Session, method: &str, id: &str, rest: &[&str]) -> Option<Response> {
    let id = id.parse::<usize>().ok()?;
    Some(match (method, rest) {
        ("PUT", ["current"]) => json_of(session.use_version(id).map(|()| session.view())),
        ("POST", ["compare", other]) => json_of(session.compare_versions(id, other.parse().ok()?)),
        _ => return None,
    })
}
