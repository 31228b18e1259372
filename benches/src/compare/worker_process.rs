//! The process of one side of a work: start, requests, peak memory, end.

use std::fs::File;
use std::io::{BufRead, BufReader, Write};
use std::path::PathBuf;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::thread::sleep;
use std::time::Duration;

use anyhow::{Context, Result, anyhow, bail};

use crate::compare::prepare::{Files, Paths};
use crate::protocol::{Answer, Ready, Request};
use crate::registry::{Side, WorkSpec};

/// Pause before each series of runs. During the pause, the other side's threads become idle; some of them spin for a
/// while after their work.
const PAUSE: Duration = Duration::from_millis(100);

/// One side of a work, ready to run.
pub struct WorkerProcess {
    /// The side that it runs.
    pub side: Side,
    /// The worker's first message, sent when it was ready.
    pub ready: Ready,
    child: Child,
    requests: Option<ChildStdin>,
    answers: BufReader<ChildStdout>,
    log: PathBuf,
}

impl WorkerProcess {
    /// Starts a worker and waits until it has warmed up.
    pub fn start(work: &WorkSpec, side: Side, files: &Files, threads: usize, paths: &Paths) -> Result<Self> {
        let mut command = match side {
            Side::Ours => {
                let mut command = Command::new(std::env::current_exe()?);
                command.args(["work", work.name]);
                command
            }
            Side::Peer(peer) => {
                let mut command = Command::new(paths.python()?);
                command.arg(paths.peers.join("worker.py")).args([peer.id, work.name]);
                command
            }
        };
        let threads = threads.to_string();
        for (flag, path) in files.arguments() {
            command.arg(flag).arg(path);
        }
        command.args(["--threads", &threads]);
        for variable in ["RAYON_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS"] {
            command.env(variable, &threads);
        }
        let log = paths.out.join("logs").join(format!("{}-{}.log", work.name, side.id()));
        let log_file = File::create(&log).with_context(|| log.display().to_string())?;
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(log_file);
        let mut child = command.spawn().with_context(|| format!("{:?}", command.get_program()))?;
        let requests = child.stdin.take();
        let answers = BufReader::new(child.stdout.take().context("expected a pipe from the worker")?);
        let nothing = Ready { seconds: None, facts: Default::default(), gflop: None, version: String::new() };
        let mut worker = Self { side, ready: nothing, child, requests, answers, log };
        match worker.answer()? {
            Answer::Ready(ready) => worker.ready = ready,
            other => bail!("expected a worker to be ready, found {other:?}"),
        }
        worker.forget_peak_memory();
        Ok(worker)
    }

    /// Runs the work `repeat` times and returns the seconds of each run.
    pub fn run(&mut self, repeat: usize) -> Result<Vec<f64>> {
        sleep(PAUSE);
        let request = serde_json::to_string(&Request { repeat })?;
        let requests = self.requests.as_mut().context("expected a running worker, found one that was stopped")?;
        if writeln!(requests, "{request}").and_then(|()| requests.flush()).is_err() {
            return Err(self.last_words());
        }
        (0..repeat)
            .map(|_| match self.answer()? {
                Answer::Seconds(seconds) => Ok(seconds),
                other => bail!("expected seconds, found {other:?}"),
            })
            .collect()
    }

    /// Peak memory since the worker was ready, in bytes; `None` if the system does not report it.
    pub fn peak_memory_bytes(&self) -> Option<u64> {
        let status = std::fs::read_to_string(format!("/proc/{}/status", self.child.id())).ok()?;
        peak_of_status(&status)
    }

    /// Resets the peak memory, so that the preparation (reading weights, making pictures) does not count. If the system
    /// does not allow this, the preparation counts.
    fn forget_peak_memory(&self) {
        let _ = std::fs::write(format!("/proc/{}/clear_refs", self.child.id()), "5");
    }

    fn answer(&mut self) -> Result<Answer> {
        let mut line = String::new();
        if self.answers.read_line(&mut line)? == 0 {
            return Err(self.last_words());
        }
        serde_json::from_str(&line).with_context(|| format!("expected an answer, found {}", line.trim_end()))
    }

    /// The reason why the worker ended: the last line of its log.
    fn last_words(&self) -> anyhow::Error {
        let log = std::fs::read_to_string(&self.log).unwrap_or_default();
        let last = log.lines().rev().find(|line| !line.trim().is_empty()).unwrap_or("it printed nothing");
        anyhow!("{} ended: {last} ({})", self.side.title(), self.log.display())
    }
}

impl Drop for WorkerProcess {
    fn drop(&mut self) {
        // A worker ends at the end of its input; a worker that does not end in time is killed.
        self.requests = None;
        for _ in 0..20 {
            if matches!(self.child.try_wait(), Ok(Some(_))) {
                return;
            }
            sleep(Duration::from_millis(50));
        }
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// `VmHWM` of `/proc/PID/status`, in bytes.
pub(crate) fn peak_of_status(status: &str) -> Option<u64> {
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    Some(line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()? * 1024)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_peak_memory() {
        assert_eq!(peak_of_status("Name:\tx\nVmHWM:\t    2048 kB\nVmRSS:\t 12 kB\n"), Some(2 << 20));
        assert_eq!(peak_of_status("Name:\tx\n"), None);
    }
}
