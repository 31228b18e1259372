//! A teaching's progress on standard error: a bar on a terminal, plain lines elsewhere.

use std::io::IsTerminal;
use std::ops::ControlFlow;

use indicatif::{ProgressBar, ProgressStyle};
use sdg_grasp::{TeachingEvent, ValidationRecord};

use crate::interrupt::Interrupt;

/// Steps between plain lines.
const LINE_EVERY: usize = 20;
/// Share of the newest loss in the smoothed one that is shown.
const SMOOTHING: f64 = 0.1;

/// Shows events and passes Ctrl-C on.
pub struct TeachingProgress {
    bar: Option<ProgressBar>,
    interrupt: Interrupt,
    told_of_interrupt: bool,
    loss: Option<f64>,
    last_validation: String,
}

impl TeachingProgress {
    /// A bar if standard error is a terminal, lines if not.
    pub fn new(interrupt: Interrupt) -> Self {
        let bar = std::io::stderr().is_terminal().then(|| {
            let bar = ProgressBar::new(0);
            let template = "teaching {bar:32.cyan/blue} {pos}/{len}  {elapsed} gone, {eta} left  {msg}";
            if let Ok(style) = ProgressStyle::with_template(template) {
                bar.set_style(style);
            }
            bar
        });
        Self { bar, interrupt, told_of_interrupt: false, loss: None, last_validation: String::new() }
    }

    /// Shows one event; breaks when Ctrl-C was pressed.
    pub fn show(&mut self, event: &TeachingEvent) -> ControlFlow<()> {
        match event {
            TeachingEvent::Step { record, planned_steps, elapsed_secs } => {
                let newest = record.losses.total();
                let loss = self.loss.map_or(newest, |loss| loss + SMOOTHING * (newest - loss));
                self.loss = Some(loss);
                let done = record.step + 1;
                match &self.bar {
                    Some(bar) => {
                        bar.set_length(*planned_steps as u64);
                        bar.set_position(done as u64);
                        bar.set_message(format!("loss {loss:.2}{}", self.last_validation));
                    }
                    None if done % LINE_EVERY == 0 || done == *planned_steps => {
                        let left = elapsed_secs / done as f64 * planned_steps.saturating_sub(done) as f64;
                        eprintln!(
                            "teaching: step {done} of {planned_steps}, loss {loss:.2}, {elapsed_secs:.0} s gone, \
                             {left:.0} s left"
                        );
                    }
                    None => {}
                }
            }
            TeachingEvent::Validated(record) => self.show_validation(record),
            TeachingEvent::OrientationStep { step, planned_steps, loss, elapsed_secs } => {
                let done = step + 1;
                match &self.bar {
                    Some(bar) => {
                        bar.set_length(*planned_steps as u64);
                        bar.set_position(done as u64);
                        bar.set_message(format!("angles, loss {loss:.2}"));
                    }
                    None if done % LINE_EVERY == 0 || done == *planned_steps => eprintln!(
                        "teaching angles: step {done} of {planned_steps}, loss {loss:.2}, {elapsed_secs:.0} s gone"
                    ),
                    None => {}
                }
            }
        }
        if self.interrupt.is_requested() {
            if !self.told_of_interrupt {
                self.told_of_interrupt = true;
                self.line("interrupted: keeping the best network so far; once more to end at once");
            }
            return ControlFlow::Break(());
        }
        ControlFlow::Continue(())
    }

    fn show_validation(&mut self, record: &ValidationRecord) {
        let v = &record.validation;
        self.last_validation = format!(
            ", found {}/{}, {:.1} px, {:.1}°, {} false",
            v.hits, v.positives, v.median_error_px, v.median_error_degrees, v.false_alarms
        );
        if self.bar.is_none() {
            eprintln!(
                "teaching: after {} steps found {} of {} held-back, median {:.1} px and {:.1}°, {} false alarms in {}",
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
