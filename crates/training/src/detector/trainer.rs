//! The detector's run: from samples to losses to the best of the validated checkpoints.

use std::ops::ControlFlow;
use std::time::Instant;

use burn::tensor::Tensor;
use sdg_detection::GeneralizedRcnn;

use super::batch::{Batch, BatchKind, SampleSource, View, prepare};
use super::config::TrainingConfig;
use super::progress::{History, LossValues, StepRecord, TrainingEvent, ValidationRecord};
use super::validation::{Outcome, Validation};
use crate::error::TrainingError;
use crate::optimizer::Stepper;
use crate::prefetch::{BatchRequest, Batches, with_batches};
use crate::run::{RunSettings, Step, Task, Validated, ValidationSteps, run};

/// A trained detector, without gradients, and the run that made it.
#[derive(Debug, Clone)]
pub struct Trained {
    /// The checkpoint with the best validation.
    pub detector: GeneralizedRcnn,
    /// Steps and validations of the run.
    pub history: History,
}

/// Trains `detector` on the samples that `source` gives by their index.
///
/// `examine` runs the present detector on the held-out samples and returns the outcome of each; `observe` gets
/// every step and every validation and may stop the run, which then keeps the best checkpoint so far.
///
/// # Errors
/// An invalid setting, a loss that is not finite, a batch that the network rejects, an end before the first validation,
/// and the errors of `examine`.
pub fn train(
    detector: GeneralizedRcnn,
    config: &TrainingConfig,
    source: SampleSource<'_>,
    examine: &mut dyn FnMut(&GeneralizedRcnn) -> Result<Vec<Outcome>, TrainingError>,
    observe: &mut dyn FnMut(&TrainingEvent) -> ControlFlow<()>,
) -> Result<Trained, TrainingError> {
    config.check()?;
    let transform = detector.config().input.clone();
    let optimizer = Stepper::new(config.optimizer, config.weight_decay, config.max_gradient_norm);
    let settings = RunSettings {
        steps: config.steps,
        time_budget: config.time_budget,
        schedule: config.schedule,
        validations: Some(ValidationSteps { first: config.validation.first, every: config.validation.every }),
    };
    let start = Instant::now();
    let prepare = |request| prepare(request, &transform, &source);
    with_batches(prepare, |batches| {
        let (steps, validations) = (Vec::with_capacity(config.steps), Vec::new());
        let mut task = DetectorTask { config, batches, examine, observe, steps, validations, best: None };
        let ended = run(&mut task, detector, optimizer, &settings, start)?;
        let elapsed_secs = start.elapsed().as_secs_f64();
        let DetectorTask { steps, validations, best, .. } = task;
        let (detector, best) = best.ok_or(TrainingError::StoppedTooEarly { step: ended.steps })?;
        Ok(Trained { detector, history: History { steps, validations, best, ending: ended.ending, elapsed_secs } })
    })
}

struct DetectorTask<'a> {
    config: &'a TrainingConfig,
    batches: &'a mut Batches<BatchKind, Batch>,
    examine: &'a mut dyn FnMut(&GeneralizedRcnn) -> Result<Vec<Outcome>, TrainingError>,
    observe: &'a mut dyn FnMut(&TrainingEvent) -> ControlFlow<()>,
    steps: Vec<StepRecord>,
    validations: Vec<ValidationRecord>,
    best: Option<(GeneralizedRcnn, ValidationRecord)>,
}

impl Task for DetectorTask<'_> {
    type Network = GeneralizedRcnn;
    type Batch = Batch;
    type Losses = LossValues;

    fn batch(&mut self, step: usize, progress: f64) -> Result<Batch, TrainingError> {
        let kind = match self.config.windows {
            Some(windows) if progress < windows.share => BatchKind { view: View::Window, size: windows.batch_size },
            _ => BatchKind { view: View::Frame, size: self.config.batch_size },
        };
        self.batches.next(BatchRequest { step, kind })
    }

    fn losses(
        &self,
        detector: &GeneralizedRcnn,
        batch: &Batch,
        step: usize,
    ) -> Result<(Tensor<1>, LossValues), TrainingError> {
        let losses = detector.losses(&batch.images, &batch.targets, step_seed(self.config.seed, step))?;
        Ok((losses.total(), LossValues::from(&losses)))
    }

    fn after_step(&mut self, made: &Step<'_, Self>) -> ControlFlow<()> {
        let &Step { step, batch, learning_rate, losses, planned_steps, elapsed_secs } = made;
        let record = StepRecord { step, samples: batch.images.len(), learning_rate, losses };
        self.steps.push(record);
        (self.observe)(&TrainingEvent::Step { record, planned_steps, elapsed_secs })
    }

    fn validate(
        &mut self,
        detector: GeneralizedRcnn,
        steps_done: usize,
        start: Instant,
    ) -> Result<Validated, TrainingError> {
        let validation = Validation::from_outcomes(&(self.examine)(&detector)?);
        let record = ValidationRecord { steps_done, elapsed_secs: start.elapsed().as_secs_f64(), validation };
        self.validations.push(record);
        // Of equal validations the later one is kept, because its learning rate was lower.
        if self.best.as_ref().is_none_or(|(_, best)| validation.merit() >= best.validation.merit()) {
            self.best = Some((detector, record));
        }
        let reached = self.config.early_stop.as_ref().filter(|early_stop| early_stop.is_reached(&validation));
        let flow = (self.observe)(&TrainingEvent::Validated(record));
        Ok(Validated { cool_down: reached.map(|early_stop| early_stop.cool_down), flow })
    }
}

/// A separate seed for every step, far from the seeds of the neighbouring steps.
pub fn step_seed(seed: u64, step: usize) -> u64 {
    seed.wrapping_add((step as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15))
}
