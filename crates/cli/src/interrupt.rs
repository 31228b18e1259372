//! Ctrl-C: the first one ends the run and keeps the results so far; the second one ends the program immediately. SIGTERM
//! and SIGHUP count as Ctrl-C, except that SIGHUP stays ignored where it was ignored at the start (`nohup`).

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

/// Blocks SIGHUP in this thread, and in the threads that it starts, if the program was started with SIGHUP ignored:
/// otherwise the handler of `ctrlc` would replace that.
#[cfg(unix)]
pub(crate) fn keep_ignoring_hangups() {
    use nix::sys::signal::{SigSet, Signal};
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| u64::from_str_radix(line.strip_prefix("SigIgn:")?.trim(), 16).ok());
    if mask.is_some_and(|mask| mask & 1 << (Signal::SIGHUP as u64 - 1) != 0) {
        let mut hangup = SigSet::empty();
        hangup.add(Signal::SIGHUP);
        // An error would leave SIGHUP as Ctrl-C.
        let _ = hangup.thread_block();
    }
}
