//! Ctrl-C: the first one ends the run and keeps the results so far; the second one, or one at a question, ends the
//! program immediately. SIGTERM and SIGHUP count as Ctrl-C, except that SIGHUP stays ignored where it was ignored at the
//! start (`nohup`).

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};

/// Minimum time between two separate signals: `timeout` sends one signal twice, to the process and to its group.
const DEBOUNCE: Duration = Duration::from_millis(500);
/// The exit code of a program that a signal ended immediately.
const INTERRUPTED: i32 = 130;

/// Whether a signal has arrived since the last call of [`Interrupt::watch`].
static IS_SIGNALLED: AtomicBool = AtomicBool::new(false);
/// Whether a question waits for its answer.
static IS_ASKING: AtomicBool = AtomicBool::new(false);

/// Whether Ctrl-C was pressed.
#[derive(Debug, Clone, Default)]
pub struct Interrupt(Arc<Request>);

#[derive(Debug, Default)]
struct Request {
    is_made: AtomicBool,
    /// The time of the first signal.
    first: OnceLock<Instant>,
}

impl Interrupt {
    /// Starts watching for Ctrl-C.
    pub fn watch() -> Self {
        IS_SIGNALLED.store(false, Ordering::SeqCst);
        let interrupt = Self::default();
        #[cfg(unix)]
        watch_terminations(&interrupt.0);
        let request = Arc::clone(&interrupt.0);
        // If no handler can be set, Ctrl-C ends the process; even then, no half-written file is left.
        let _ = ctrlc::set_handler(move || request.signalled());
        interrupt
    }

    /// Whether Ctrl-C was pressed.
    pub fn is_requested(&self) -> bool {
        self.0.is_made.load(Ordering::SeqCst)
    }
}

impl Request {
    fn signalled(&self) {
        self.is_made.store(true, Ordering::SeqCst);
        IS_SIGNALLED.store(true, Ordering::SeqCst);
        let is_second = self.first.get_or_init(Instant::now).elapsed() > DEBOUNCE;
        if is_second || IS_ASKING.load(Ordering::SeqCst) {
            std::process::exit(INTERRUPTED);
        }
    }
}

/// Asks a question before anything moves. A signal then ends the program: reading the answer cannot be interrupted.
pub(crate) fn while_asking<T>(ask: impl FnOnce() -> T) -> T {
    IS_ASKING.store(true, Ordering::SeqCst);
    if IS_SIGNALLED.load(Ordering::SeqCst) {
        std::process::exit(INTERRUPTED);
    }
    let answer = ask();
    IS_ASKING.store(false, Ordering::SeqCst);
    answer
}

/// SIGTERM and SIGHUP as a request: a program that drives an arm over ROS 2 must cancel the motion before it ends. A
/// SIGHUP that was ignored at the start stays ignored.
#[cfg(unix)]
fn watch_terminations(request: &Arc<Request>) {
    use signal_hook::consts::{SIGHUP, SIGTERM};
    use std::io::{ErrorKind, Read};
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let ignored = status.lines().find_map(|line| u64::from_str_radix(line.strip_prefix("SigIgn:")?.trim(), 16).ok());
    let is_ignored = |signal: i32| ignored.is_some_and(|mask| mask >> (signal - 1) & 1 != 0);
    // If no handler can be set, the signal ends the process; even then, no half-written file is left.
    let Ok((mut signals, handler)) = std::os::unix::net::UnixStream::pair() else { return };
    let request = Arc::clone(request);
    // A handler of a signal may do little more than write a byte.
    let receive = move || {
        loop {
            match signals.read(&mut [0; 1]) {
                Ok(1) => request.signalled(),
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                _ => return,
            }
        }
    };
    if std::thread::Builder::new().name("signals".to_owned()).spawn(receive).is_err() {
        return;
    }
    for signal in [SIGTERM, SIGHUP].into_iter().filter(|signal| !is_ignored(*signal)) {
        if let Ok(handler) = handler.try_clone() {
            let _ = signal_hook::low_level::pipe::register(signal, handler);
        }
    }
}

#[cfg(all(test, unix))]
mod tests {
    use std::io::{BufRead, BufReader};
    use std::process::{Child, Command, Stdio};
    use std::thread::sleep;

    use super::*;

    /// The role of this test's program that gets the signals.
    const ROLE: &str = "SDG_TEST_OF_SIGNALS";

    /// Starts this test in another program, and waits until that watches for signals.
    fn start(role: &str) -> Child {
        let name = "interrupt::tests::a_second_sigterm_or_one_at_a_question_ends_the_program";
        let mut child = Command::new(std::env::current_exe().unwrap())
            .args([name, "--exact", "--nocapture"])
            .env(ROLE, role)
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
        assert!(lines.any(|line| line.unwrap().contains("watching")));
        child
    }

    /// Sends SIGTERM to a program twice, as `timeout` does.
    fn terminate(child: &Child) {
        let pid = child.id().to_string();
        assert!(Command::new("kill").args(["-TERM", &pid, &pid]).status().unwrap().success());
    }

    #[test]
    fn a_second_sigterm_or_one_at_a_question_ends_the_program() {
        if let Ok(role) = std::env::var(ROLE) {
            let interrupt = Interrupt::watch();
            println!("watching");
            let wait = || sleep(Duration::from_secs(60));
            if role == "asking" {
                while_asking(wait)
            } else {
                wait()
            }
            assert!(interrupt.is_requested());
            return;
        }
        let mut asking = start("asking");
        terminate(&asking);
        assert_eq!(asking.wait().unwrap().code(), Some(INTERRUPTED));
        let mut working = start("working");
        terminate(&working);
        sleep(2 * DEBOUNCE);
        assert_eq!(working.try_wait().unwrap(), None);
        terminate(&working);
        assert_eq!(working.wait().unwrap().code(), Some(INTERRUPTED));
    }
}
