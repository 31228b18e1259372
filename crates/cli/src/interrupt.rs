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
        #[cfg(unix)]
        watch_terminations(&interrupt.0);
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

/// SIGTERM and SIGHUP as a request: a program that drives an arm over ROS 2 must cancel the motion before it ends. A
/// SIGHUP that was ignored at the start stays ignored.
#[cfg(unix)]
fn watch_terminations(flag: &Arc<AtomicBool>) {
    use signal_hook::consts::{SIGHUP, SIGTERM};
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let ignored = status.lines().find_map(|line| u64::from_str_radix(line.strip_prefix("SigIgn:")?.trim(), 16).ok());
    let is_ignored = |signal: i32| ignored.is_some_and(|mask| mask >> (signal - 1) & 1 != 0);
    for signal in [SIGTERM, SIGHUP].into_iter().filter(|signal| !is_ignored(*signal)) {
        // If no handler can be set, the signal ends the process; even then, no half-written file is left.
        let _ = signal_hook::flag::register(signal, Arc::clone(flag));
    }
}
