//! Errors reported by the network, as errors of this crate.

use crate::error::RosError;

pub(super) fn network(what: &str, why: impl ToString) -> RosError {
    RosError::Network { what: what.to_owned(), why: why.to_string() }
}
