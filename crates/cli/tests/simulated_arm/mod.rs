//! `sdg simulate --fci` for the tests of commands that drive an arm on the network.

use std::io::{BufRead, BufReader};
use std::net::TcpListener;
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicU16, Ordering};
#[cfg(unix)]
use std::time::{Duration, Instant};

/// Maximum duration of the end of the program after a signal, far beyond that on a busy machine.
#[cfg(unix)]
const MAX_ENDING: Duration = Duration::from_secs(60);

use crate::support::assert_fields_are_documented;

static NUM_STARTED: AtomicU16 = AtomicU16::new(0);

/// A simulated Panda on the network, started as another program; killed when dropped.
pub struct Simulated {
    child: Child,
    pub address: String,
}

impl Simulated {
    pub fn start(further: &[&str]) -> Self {
        Self::start_by(Command::new(env!("CARGO_BIN_EXE_sdg")), further)
    }

    /// As [`Self::start`], by another program that ends with the path of `sdg`.
    pub fn start_by(mut program: Command, further: &[&str]) -> Self {
        // Two free neighbouring ports that no other test will use: tests run at the same time in processes with
        // neighbouring numbers, each of which has twenty ports of its own.
        let of_process = 20_000 + (std::process::id() % 600) as u16 * 20;
        let begin = of_process + NUM_STARTED.fetch_add(1, Ordering::Relaxed) * 2;
        let port = (begin..60_000)
            .find(|&port| (port..port + 2).all(|port| TcpListener::bind(("127.0.0.1", port)).is_ok()))
            .unwrap()
            .to_string();
        let mut child = program
            .args(["simulate", "--fci", "--lockstep", "--json", "--port", &port])
            .args(further)
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let mut line = String::new();
        BufReader::new(child.stdout.take().unwrap()).read_line(&mut line).unwrap();
        assert!(line.contains(&port), "{line}");
        assert_fields_are_documented(&["simulate", "--json"], line.as_bytes());
        Self { child, address: format!("127.0.0.1:{port}") }
    }

    #[cfg(unix)]
    pub fn signal(&self, signal: &str) {
        let sent = Command::new("kill").args([signal, &self.child.id().to_string()]).status().unwrap();
        assert!(sent.success());
    }

    /// The exit code after a signal, which ends the program within [`MAX_ENDING`].
    #[cfg(unix)]
    pub fn interrupted(mut self, signal: &str) -> Option<i32> {
        self.signal(signal);
        let deadline = Instant::now() + MAX_ENDING;
        loop {
            if let Some(status) = self.child.try_wait().unwrap() {
                return status.code();
            }
            assert!(Instant::now() < deadline, "{signal} did not end the program within {MAX_ENDING:?}");
            std::thread::sleep(Duration::from_millis(20));
        }
    }
}

impl Drop for Simulated {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
