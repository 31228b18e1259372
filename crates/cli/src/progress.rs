//! Progress of an evaluation on standard error: a line per finished unit, and on a terminal a bar below.

use std::io::IsTerminal;
use std::sync::Mutex;
use std::sync::PoisonError;
use std::time::Instant;

use indicatif::{ProgressBar, ProgressStyle};
use sdg_evaluation::Progress;

/// Shows progress. All workers share one instance.
pub struct EvaluationProgress {
    bar: Option<ProgressBar>,
    started: Instant,
    counted: Mutex<Counted>,
}

#[derive(Default)]
struct Counted {
    done: usize,
    of: usize,
}

impl Default for EvaluationProgress {
    fn default() -> Self {
        Self::new()
    }
}

impl EvaluationProgress {
    /// A bar if standard error is a terminal.
    pub fn new() -> Self {
        let bar = std::io::stderr().is_terminal().then(|| {
            let bar = ProgressBar::new(0);
            if let Ok(style) = ProgressStyle::with_template("{bar:32.cyan/blue} {pos} of {len} units  {elapsed} gone") {
                bar.set_style(style);
            }
            bar.enable_steady_tick(std::time::Duration::from_secs(1));
            bar
        });
        Self { bar, started: Instant::now(), counted: Mutex::default() }
    }

    /// Removes the bar.
    pub fn finish(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}

impl Progress for EvaluationProgress {
    fn expect(&self, units: usize) {
        self.counted.lock().unwrap_or_else(PoisonError::into_inner).of += units;
        if let Some(bar) = &self.bar {
            bar.inc_length(units as u64);
        }
    }

    fn unit_done(&self, what: &str) {
        let mut counted = self.counted.lock().unwrap_or_else(PoisonError::into_inner);
        counted.done += 1;
        let (done, of) = (counted.done, counted.of);
        // Printed while the lock is held, so that lines are in the order of their numbers.
        self.print_line(&format!("[{done}/{of}, {:.0} s] {what}", self.started.elapsed().as_secs_f64()));
        if let Some(bar) = &self.bar {
            bar.inc(1);
        }
    }

    fn print_line(&self, text: &str) {
        match &self.bar {
            Some(bar) => bar.println(text),
            None => eprintln!("{text}"),
        }
    }
}
