//! Requests to choose, create and close projects.

use super::answers::json_of;
use crate::desk::Desk;
use crate::http::{Request, Response};

/// Answers requests about projects; `None` for an unknown address.
pub fn answer(desk: &Desk, request: &Request, rest: &[&str]) -> Option<Response> {
    let head = &request.head;
    Some(match (head.method.as_str(), rest) {
        ("POST", []) => {
            let value = |name: &str| head.query_value(name).unwrap_or_default();
            json_of(desk.create(&value("name"), &value("photo"), &request.body))
        }
        ("DELETE", []) => json_of(desk.close()),
        ("POST", [id, "open"]) => json_of(desk.open(id)),
        _ => return None,
    })
}
