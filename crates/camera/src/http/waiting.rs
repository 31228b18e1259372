//! The remaining time of a read or write, and the text of a timeout.

use std::io;
use std::time::{Duration, Instant};

/// The time until the deadline; `None` if it has passed.
pub(super) fn time_left(deadline: Instant) -> Option<Duration> {
    // The system rejects a read timeout of 0; below a millisecond the time counts as over.
    deadline.checked_duration_since(Instant::now()).filter(|left| *left >= Duration::from_millis(1))
}

/// The system's message; timeouts get a uniform text, because theirs depends on the system.
pub(super) fn in_words(error: io::Error) -> String {
    match error.kind() {
        io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut => "nothing in time".to_owned(),
        _ => error.to_string(),
    }
}
