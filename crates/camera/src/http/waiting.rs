//! How long a read or write may still wait, and what the system says when it took longer.

use std::io;
use std::time::{Duration, Instant};

/// `None` when it is over.
pub(super) fn time_left(deadline: Instant) -> Option<Duration> {
    // A read timeout of 0 is refused by the system; less than a millisecond is as good as nothing.
    deadline.checked_duration_since(Instant::now()).filter(|left| *left >= Duration::from_millis(1))
}

/// The system's message; that of a timeout depends on the system.
pub(super) fn in_words(error: io::Error) -> String {
    match error.kind() {
        io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut => "nothing in time".to_owned(),
        _ => error.to_string(),
    }
}
