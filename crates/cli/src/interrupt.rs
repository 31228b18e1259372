//! Ctrl-C: the first ends the run with what there is, the second at once.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Signals this close are one: `timeout -s INT` sends it to the process and to its group.
const SAME_PRESS: Duration = Duration::from_millis(500);

/// Whether Ctrl-C was pressed.
#[derive(Debug, Clone, Default)]
pub struct Interrupt(Arc<AtomicBool>);

impl Interrupt {
    /// Watches for Ctrl-C from now on.
    pub fn watch() -> Self {
        let interrupt = Self::default();
        let flag = Arc::clone(&interrupt.0);
        let mut first: Option<Instant> = None;
        // Without a handler Ctrl-C ends the process, which leaves nothing half-written either.
        let _ = ctrlc::set_handler(move || {
            flag.store(true, Ordering::SeqCst);
            if first.get_or_insert_with(Instant::now).elapsed() > SAME_PRESS {
                std::process::exit(130);
            }
        });
        interrupt
    }

    /// Whether it was pressed.
    pub fn is_requested(&self) -> bool {
        self.0.load(Ordering::SeqCst)
    }
}
