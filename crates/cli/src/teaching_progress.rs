//! Progress of teaching on standard error: a bar on a terminal, plain lines otherwise.

use std::io::IsTerminal;
use std::ops::ControlFlow;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use sdg_grasp::{TeachingEvent, ValidationRecord};

use crate::interrupt::Interrupt;

/// Number of steps between plain lines.
const STEPS_PER_LINE: usize = 20;
/// Weight of the newest loss in the displayed moving average.
const SMOOTHING: f64 = 0.1;

/// The bar. The message gets the rest of the terminal's width and is cut at its end.
const TEMPLATE: &str = "teaching {bar:12.cyan/blue} {pos}/{len} {wide_msg}";
/// Shown after the last step, while the model is tested.
const AFTER_LAST_STEP: &str = "testing it on held-out samples";

/// Shows events, and stops the teaching on Ctrl-C.
pub struct TeachingProgress {
    bar: Option<ProgressBar>,
    interrupt: Interrupt,
    told_of_interrupt: bool,
    loss: Option<f64>,
    last_validation: String,
}

impl TeachingProgress {
    /// Creates a display with a bar if standard error is a terminal, otherwise with lines.
    pub fn new(interrupt: Interrupt) -> Self {
        let bar = std::io::stderr().is_terminal().then(|| bar_on(ProgressDrawTarget::stderr()));
        Self { bar, interrupt, told_of_interrupt: false, loss: None, last_validation: String::new() }
    }

    /// Shows one event; breaks after Ctrl-C.
    pub fn show(&mut self, event: &TeachingEvent) -> ControlFlow<()> {
        match event {
            TeachingEvent::Step { record, planned_steps, elapsed_secs } => {
                let newest = record.losses.total();
                let loss = self.loss.map_or(newest, |loss| loss + SMOOTHING * (newest - loss));
                self.loss = Some(loss);
                let done = record.step + 1;
                let left = left_secs(*elapsed_secs, done, *planned_steps);
                match &self.bar {
                    Some(bar) => {
                        let left =
                            left.map_or_else(|| AFTER_LAST_STEP.to_owned(), |left| format!("{} left", clock(left)));
                        show_step(bar, done, *planned_steps, {
                            format!("{} gone, {left}, loss {loss:.2}{}", clock(*elapsed_secs), self.last_validation)
                        });
                    }
                    None if done % STEPS_PER_LINE == 0 || done == *planned_steps => {
                        let left = left.map_or_else(|| AFTER_LAST_STEP.to_owned(), |left| format!("{left:.0} s left"));
                        eprintln!(
                            "teaching: step {done} of {planned_steps}, loss {loss:.2}, {elapsed_secs:.0} s gone, {left}"
                        );
                    }
                    None => {}
                }
            }
            TeachingEvent::Validated(record) => self.show_validation(record),
            TeachingEvent::OrientationStep { step, planned_steps, loss, elapsed_secs } => {
                let done = step + 1;
                match &self.bar {
                    Some(bar) => show_step(bar, done, *planned_steps, {
                        format!("{} gone, loss {loss:.2}: angles, then the network", clock(*elapsed_secs))
                    }),
                    None if done % STEPS_PER_LINE == 0 || done == *planned_steps => eprintln!(
                        "teaching angles: step {done} of {planned_steps}, loss {loss:.2}, {elapsed_secs:.0} s gone"
                    ),
                    None => {}
                }
            }
        }
        if self.interrupt.is_requested() {
            if !self.told_of_interrupt && self.has_network() {
                self.told_of_interrupt = true;
                self.line("interrupted: keeping the best network so far; press Ctrl-C again to stop at once");
            }
            return ControlFlow::Break(());
        }
        ControlFlow::Continue(())
    }

    /// Whether there is a network to keep after Ctrl-C; without one, teaching ends with an error that says so.
    fn has_network(&self) -> bool {
        !self.last_validation.is_empty()
    }

    fn show_validation(&mut self, record: &ValidationRecord) {
        let v = &record.validation;
        self.last_validation = format!(
            ", network {}/{}, {:.1} px, {:.1}°, {} false",
            v.hits, v.positives, v.median_error_px, v.median_error_degrees, v.false_alarms
        );
        if self.bar.is_none() {
            eprintln!(
                "teaching: after {} steps the network alone finds {} of {} held-out, median {:.1} px and {:.1}°; \
                 false alarms in {} of {}",
                record.steps_done,
                v.hits,
                v.positives,
                v.median_error_px,
                v.median_error_degrees,
                v.false_alarms,
                v.negatives
            );
        }
    }

    fn line(&self, text: &str) {
        match &self.bar {
            Some(bar) => bar.println(format!("teaching: {text}")),
            None => eprintln!("teaching: {text}"),
        }
    }

    /// Removes the bar.
    pub fn finish(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}

fn bar_on(target: ProgressDrawTarget) -> ProgressBar {
    let bar = ProgressBar::with_draw_target(Some(0), target);
    if let Ok(style) = ProgressStyle::with_template(TEMPLATE) {
        bar.set_style(style);
    }
    bar
}

fn show_step(bar: &ProgressBar, done: usize, planned: usize, message: String) {
    bar.set_length(planned as u64);
    bar.set_position(done as u64);
    bar.set_message(message);
}

/// Estimated seconds until the last step, at the average pace so far. `None` after the last step, because the remaining
/// work is unknown.
fn left_secs(elapsed_secs: f64, done: usize, planned: usize) -> Option<f64> {
    (done < planned).then(|| elapsed_secs / done as f64 * (planned - done) as f64)
}

/// Minutes and seconds, rounded up, so that a remaining time is never shown as zero.
fn clock(secs: f64) -> String {
    let secs = secs.ceil() as u64;
    format!("{}:{:02}", secs / 60, secs % 60)
}

#[cfg(test)]
mod tests {
    use super::*;
    use indicatif::TermLike;
    use sdg_grasp::Validation;
    use std::io;
    use std::sync::{Arc, Mutex};

    /// A terminal of 80 columns that records its output.
    #[derive(Debug, Clone, Default)]
    struct Terminal(Arc<Mutex<String>>);

    impl TermLike for Terminal {
        fn width(&self) -> u16 {
            80
        }
        fn move_cursor_up(&self, _: usize) -> io::Result<()> {
            Ok(())
        }
        fn move_cursor_down(&self, _: usize) -> io::Result<()> {
            Ok(())
        }
        fn move_cursor_right(&self, _: usize) -> io::Result<()> {
            Ok(())
        }
        fn move_cursor_left(&self, _: usize) -> io::Result<()> {
            Ok(())
        }
        fn write_line(&self, text: &str) -> io::Result<()> {
            self.write_str(text)
        }
        fn write_str(&self, text: &str) -> io::Result<()> {
            self.0.lock().unwrap().push_str(&format!("{text}\n"));
            Ok(())
        }
        fn clear_line(&self) -> io::Result<()> {
            Ok(())
        }
        fn flush(&self) -> io::Result<()> {
            Ok(())
        }
    }

    /// Removes colour codes.
    fn plain(text: &str) -> String {
        let mut parts = text.split('\u{1b}');
        let first = parts.next().unwrap_or_default().to_owned();
        parts.fold(first, |text, part| text + part.split_once('m').map_or("", |(_, rest)| rest))
    }

    #[test]
    fn the_line_is_no_wider_than_a_terminal() {
        let terminal = Terminal::default();
        let bar = bar_on(ProgressDrawTarget::term_like_with_hz(Box::new(terminal.clone()), 255));
        let validation = ", network 40/48, 10.6 px, 10.5°, 12 false";
        let message = format!("{} gone, {} left, loss 10.52{validation}", clock(3599.0), clock(3599.0));
        show_step(&bar, 1000, 1000, message);
        bar.force_draw();
        let written = plain(&terminal.0.lock().unwrap());
        assert!(written.contains("59:59 gone, 59:59 left, loss"), "{written}");
        assert!(written.lines().all(|line| line.chars().count() <= 80), "{written}");
    }

    #[test]
    fn a_network_is_kept_only_after_the_first_validation_of_the_detector() {
        let mut progress = TeachingProgress { bar: None, ..TeachingProgress::new(Interrupt::default()) };
        let angles = TeachingEvent::OrientationStep { step: 0, planned_steps: 60, loss: 5.9, elapsed_secs: 0.2 };
        assert!(progress.show(&angles).is_continue() && !progress.has_network());
        let validation = Validation {
            positives: 4,
            hits: 3,
            median_error_px: 1.0,
            median_error_degrees: 1.0,
            negatives: 1,
            false_alarms: 0,
        };
        let record = ValidationRecord { steps_done: 40, elapsed_secs: 9.0, validation };
        assert!(progress.show(&TeachingEvent::Validated(record)).is_continue() && progress.has_network());
    }

    #[test]
    fn nothing_is_left_only_after_the_last_step() {
        assert_eq!(left_secs(9.0, 3, 4), Some(3.0));
        assert_eq!(left_secs(12.0, 4, 4), None);
        assert_eq!((clock(0.2).as_str(), clock(61.0).as_str()), ("0:01", "1:01"));
    }
}
