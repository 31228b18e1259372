//! Ctrl-C: the first one ends the run and keeps the results so far; the second one ends the program immediately. SIGTERM
//! and SIGHUP count as Ctrl-C, also in a program that was started with SIGHUP ignored (`nohup`).

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Minimum time between two separate signals: `timeout -s INT` sends one signal twice, to the process and to its group.
const DEBOUNCE: Duration = Duration::from_millis(500);

/// Whether Ctrl-C was pressed.
#[derive(Debug, Clone, Default)]
pub struct Interrupt(Arc<AtomicBool>);

impl Interrupt {
    /// Starts watching for Ctrl-C.
    pub fn watch() -> Self {
        let interrupt = Self::default();
        let flag = Arc::clone(&interrupt.0);
        let mut first: Option<Instant> = None;
        // If no handler can be set, Ctrl-C ends the process; even then, no half-written file is left.
        let _ = ctrlc::set_handler(move || {
            flag.store(true, Ordering::SeqCst);
            if first.get_or_insert_with(Instant::now).elapsed() > DEBOUNCE {
                std::process::exit(130);
            }
        });
        interrupt
    }

    /// Whether Ctrl-C was pressed.
    pub fn is_requested(&self) -> bool {
        self.0.load(Ordering::SeqCst)
    }
}
