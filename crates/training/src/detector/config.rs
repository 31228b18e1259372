//! The settings of a run.

use std::time::Duration;

use serde::{Deserialize, Serialize};

use super::validation::Validation;
use crate::error::TrainingError;
use crate::optimizer::Optimizer;
use crate::schedule::OneCycle;

/// How a detector is trained.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TrainingConfig {
    /// Optimiser steps, unless early stop or the time budget ends the run earlier.
    pub steps: usize,
    /// Images per step.
    pub batch_size: usize,
    /// The first part of the run, on windows of frames; `None` for whole frames from the start.
    pub windows: Option<WindowPhase>,
    /// The optimiser.
    pub optimizer: Optimizer,
    /// Learning rate over the run.
    pub schedule: OneCycle,
    /// Weight decay; decoupled from the gradients in AdamW.
    pub weight_decay: f64,
    /// Maximum norm of each parameter's gradient; larger gradients are scaled down.
    pub max_gradient_norm: f32,
    /// When and on how many samples to validate.
    pub validation: ValidationConfig,
    /// When a run is good enough to end before its last step.
    pub early_stop: Option<EarlyStop>,
    /// Wall-clock time for the whole run. The learning rate then follows the progress of the steps or of the time,
    /// depending on which is larger, so that a shortened run also ends with a low learning rate. Runs that the budget
    /// shortens depend on the machine's speed.
    pub time_budget: Option<Duration>,
    /// Seed of the samples, their order and every random choice of the losses.
    pub seed: u64,
}

/// The part of a run that learns from windows: small pictures around the part, at the scale of whole frames.
///
/// The detector is convolutional, so features learnt in a window are valid in the frame. A window takes a fraction of
/// a frame's time, so the network learns several times as many angles, lights and tables in the same time. The frames
/// at the end teach the areas far from any part. (Rod end, 120 steps: 21 of 35 held-out parts found with windows,
/// none with frames.)
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct WindowPhase {
    /// Fraction of the run, in [0, 1).
    pub share: f64,
    /// Windows per step.
    pub batch_size: usize,
}

/// Times of the validations, and number of their samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct ValidationConfig {
    /// Steps between validations.
    pub every: usize,
    /// No validation before this step, because the network's output is not useful yet.
    pub first: usize,
    /// Held-out samples, with and without the part.
    pub samples: usize,
}

/// The criteria for early stop. When a validation meets them, the learning rate is reduced within `cool_down` steps
/// and the run ends.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct EarlyStop {
    /// Minimum fraction of parts found close enough for a grasp.
    pub hit_rate: f64,
    /// Maximum median error, in demonstration pixels.
    pub median_error_px: f64,
    /// Maximum median error, in degrees.
    pub median_error_degrees: f64,
    /// Maximum ratio of false alarms to negatives; the allowed number of false alarms is rounded up, because one of
    /// five negatives is weak evidence.
    pub false_alarm_rate: f64,
    /// Steps from the validation that was good enough to the end.
    pub cool_down: usize,
}

impl EarlyStop {
    /// Whether a validation is good enough.
    pub fn is_reached(&self, validation: &Validation) -> bool {
        validation.hit_rate() >= self.hit_rate
            && validation.median_error_px <= self.median_error_px
            && validation.median_error_degrees <= self.median_error_degrees
            && validation.false_alarms as f64 <= (self.false_alarm_rate * validation.negatives as f64).ceil()
    }
}

impl TrainingConfig {
    /// The default for the `edge` network from random values on two cores: one and a half to three minutes from one
    /// photo.
    pub fn edge(seed: u64) -> Self {
        Self {
            steps: 300,
            batch_size: 4,
            windows: Some(WindowPhase { share: 0.7, batch_size: 16 }),
            optimizer: Optimizer::AdamW,
            schedule: OneCycle { peak: 1e-3, warm_up: 0.2 },
            weight_decay: 1e-4,
            max_gradient_norm: 10.0,
            validation: ValidationConfig { every: 40, first: 120, samples: 48 },
            early_stop: Some(EarlyStop {
                hit_rate: 0.97,
                median_error_px: 3.0,
                median_error_degrees: 1.5,
                false_alarm_rate: 0.0,
                cool_down: 40,
            }),
            time_budget: None,
            seed,
        }
    }

    /// Rejects invalid settings.
    pub(crate) fn check(&self) -> Result<(), TrainingError> {
        let refuse = |setting, expected, found: String| Err(TrainingError::BadSetting { setting, expected, found });
        if self.steps == 0 {
            return refuse("steps", "at least 1", self.steps.to_string());
        }
        if self.batch_size == 0 {
            return refuse("batch size", "at least 1", self.batch_size.to_string());
        }
        if let Some(WindowPhase { share, batch_size }) = self.windows
            && !((0.0..1.0).contains(&share) && batch_size > 0)
        {
            let found = format!("a share of {share} with batches of {batch_size}");
            return refuse("windows", "a share in [0, 1) and at least one window per batch", found);
        }
        if self.validation.every == 0 || self.validation.samples == 0 {
            let found = format!("every {} steps on {} samples", self.validation.every, self.validation.samples);
            return refuse("validation", "an interval of at least 1 step, and at least 1 sample", found);
        }
        if !(self.schedule.peak > 0.0 && self.schedule.peak.is_finite()) {
            return refuse("learning rate", "a positive number", self.schedule.peak.to_string());
        }
        if !(self.schedule.warm_up > 0.0 && self.schedule.warm_up < 1.0) {
            return refuse("warm-up", "a share between 0 and 1", self.schedule.warm_up.to_string());
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_without_steps_is_refused() {
        let config = TrainingConfig { steps: 0, ..TrainingConfig::edge(1) };
        assert!(config.check().unwrap_err().to_string().contains("steps: expected at least 1, found 0"));
        assert!(TrainingConfig::edge(1).check().is_ok());
        let windows = Some(WindowPhase { share: 1.0, batch_size: 16 });
        let refused = TrainingConfig { windows, ..TrainingConfig::edge(1) }.check().unwrap_err().to_string();
        assert!(refused.contains("a share in [0, 1)"), "{refused}");
    }

    #[test]
    fn one_false_alarm_is_not_good_enough() {
        let stop = TrainingConfig::edge(1).early_stop.unwrap();
        let good = Validation {
            positives: 40,
            hits: 40,
            median_error_px: 1.0,
            median_error_degrees: 0.5,
            negatives: 12,
            false_alarms: 0,
        };
        assert!(stop.is_reached(&good));
        assert!(!stop.is_reached(&Validation { false_alarms: 1, ..good }));
        assert!(!stop.is_reached(&Validation { hits: 38, ..good }));
    }
}
