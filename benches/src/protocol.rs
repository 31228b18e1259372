//! The protocol between `compare` and its workers: one JSON object per line.
//!
//! ```text
//! worker: {"ready": {"seconds": s, "facts": {…}, "gflop": g, "version": "…"}}   after one run that does not count
//! driver: {"repeat": n}
//! worker: {"seconds": s}                                                        n times
//! ```
//!
//! A worker ends at the end of its standard input. `peers/protocol.py` implements this protocol in Python.

use std::collections::BTreeMap;
use std::io::{BufRead, Write};
use std::time::Instant;

use anyhow::{Context, Result};
use serde::{Deserialize, Serialize};

/// Numbers that identify the result; those of our worker and of a peer must agree within 1 %.
pub type Facts = BTreeMap<String, f64>;

/// The first line of a worker.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Ready {
    /// Seconds of the whole warm-up run; `None` without a warm-up.
    pub seconds: Option<f64>,
    pub facts: Facts,
    /// Multiplications and additions in the network's products, in units of 1e9, if the worker counts them.
    pub gflop: Option<f64>,
    /// Name and version of the software.
    pub version: String,
}

/// A message from worker to driver.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Answer {
    /// The worker is ready to be timed.
    Ready(Ready),
    /// Seconds of one run, divided by its number of pieces.
    Seconds(f64),
}

/// A message from driver to worker.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Request {
    pub repeat: usize,
}

/// A computation to be timed.
pub struct Work {
    pub run: Box<dyn FnMut() -> Result<()>>,
    pub facts: Facts,
    /// Number of pieces that one run makes; the answers to `repeat` are per piece.
    pub pieces: usize,
    /// Whether an untimed run goes first.
    pub warm_up: bool,
}

impl Work {
    /// One piece a run, with a warm-up.
    pub fn new(facts: Facts, run: impl FnMut() -> Result<()> + 'static) -> Self {
        Self { run: Box::new(run), facts, pieces: 1, warm_up: true }
    }

    fn timed(&mut self) -> Result<f64> {
        let start = Instant::now();
        (self.run)()?;
        Ok(start.elapsed().as_secs_f64() / self.pieces as f64)
    }
}

/// Builds the work, warms up and serves runs until standard input ends.
pub fn serve(build: impl FnOnce() -> Result<Work>) -> Result<()> {
    let mut work = build()?;
    let mut out = std::io::stdout().lock();
    let mut tell = |answer: &Answer| -> Result<()> {
        writeln!(out, "{}", serde_json::to_string(answer)?)?;
        Ok(out.flush()?)
    };
    let seconds = if work.warm_up { Some(work.timed()? * work.pieces as f64) } else { None };
    let version = concat!("sdg ", env!("CARGO_PKG_VERSION")).to_owned();
    tell(&Answer::Ready(Ready { seconds, facts: work.facts.clone(), gflop: None, version }))?;
    for line in std::io::stdin().lock().lines() {
        let line = line?;
        let request: Request =
            serde_json::from_str(&line).with_context(|| format!("expected {{\"repeat\": n}}, found {line}"))?;
        for _ in 0..request.repeat {
            tell(&Answer::Seconds(work.timed()?))?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_as_the_python_workers_write_them() {
        let line = r#"{"ready": {"seconds": 0.5, "facts": {"boxes": 100}, "gflop": null, "version": "torch 2.15.0"}}"#;
        let Answer::Ready(ready) = serde_json::from_str(line).unwrap() else { panic!("it is ready") };
        assert_eq!((ready.seconds, ready.facts["boxes"], ready.gflop), (Some(0.5), 100.0, None));
        assert_eq!(serde_json::from_str::<Answer>(r#"{"seconds": 0.25}"#).unwrap(), Answer::Seconds(0.25));
        assert_eq!(serde_json::to_string(&Request { repeat: 3 }).unwrap(), r#"{"repeat":3}"#);
    }
}
