//! How long a person has waited: from the program's start, not from where the work of a verb begins.

use std::sync::OnceLock;
use std::time::Instant;

static STARTED: OnceLock<Instant> = OnceLock::new();

/// Notes the program's start; called first, and once.
pub fn start() {
    STARTED.get_or_init(Instant::now);
}

/// Seconds since the program's start.
pub fn elapsed_secs() -> f64 {
    STARTED.get_or_init(Instant::now).elapsed().as_secs_f64()
}
