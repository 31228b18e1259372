//! The remaining time of a read or write, and the text for a timeout.

use std::io;
use std::time::{Duration, Instant};

/// The time until the deadline; `None` if it has passed.
pub(super) fn time_left(deadline: Instant) -> Option<Duration> {
    // The operating system rejects a read timeout of 0, so less than a millisecond counts as over.
    deadline.checked_duration_since(Instant::now()).filter(|left| *left >= Duration::from_millis(1))
}

/// The operating system's message, except for timeouts, whose messages differ between systems.
pub(super) fn in_words(error: io::Error) -> String {
    match error.kind() {
        io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut => "no data in time".to_owned(),
        _ => error.to_string(),
    }
}
