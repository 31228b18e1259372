//! The time since the program's start, so that reported durations include all waiting.

use std::sync::OnceLock;
use std::time::Instant;

static STARTED: OnceLock<Instant> = OnceLock::new();

/// Records the program's start. Must be called once, before anything else.
pub fn start() {
    STARTED.get_or_init(Instant::now);
}

/// Seconds since the program's start.
pub fn elapsed_secs() -> f64 {
    STARTED.get_or_init(Instant::now).elapsed().as_secs_f64()
}
