//! The loop: batch, losses, gradients, step; now and then a validation.

use std::ops::ControlFlow;
use std::time::Instant;

use burn::module::Module;
use burn::optim::GradientsParams;
use sdg_detection::GeneralizedRcnn;

use crate::batch::{Batch, BatchRequest, Batches, SampleSource, View, with_batches};
use crate::config::TrainingConfig;
use crate::error::TrainingError;
use crate::optimizer::Stepper;
use crate::pace::Pace;
use crate::progress::{Ending, History, LossValues, StepRecord, TrainingEvent, ValidationRecord};
use crate::validation::{Outcome, Validation};

/// A trained detector, without gradients, and the run that made it.
#[derive(Debug, Clone)]
pub struct Trained {
    /// The checkpoint with the best validation.
    pub detector: GeneralizedRcnn,
    /// The run.
    pub history: History,
}

/// Trains `detector` on the samples that `source` gives by their index.
///
/// `examine` looks at the held-back samples with the detector as it is and says what became of each; `observe` hears
/// of every step and every validation and may end the run, which then keeps the best checkpoint so far.
///
/// # Errors
/// A bad setting, a loss that is not finite, a network that refuses a batch, or an end before the first validation.
pub fn train(
    detector: GeneralizedRcnn,
    config: &TrainingConfig,
    source: SampleSource<'_>,
    examine: &mut dyn FnMut(&GeneralizedRcnn) -> Result<Vec<Outcome>, TrainingError>,
    observe: &mut dyn FnMut(&TrainingEvent) -> ControlFlow<()>,
) -> Result<Trained, TrainingError> {
    config.check()?;
    let transform = detector.config().input.clone();
    let run = Run {
        detector,
        optimizer: Stepper::new(config),
        config,
        pace: Pace::new(config.steps, config.time_budget.map(|budget| budget.as_secs_f64())),
        start: Instant::now(),
        steps: Vec::with_capacity(config.steps),
        validations: Vec::new(),
        best: None,
    };
    with_batches(&transform, source, |batches| run.run(batches, examine, observe))
}

struct Run<'a> {
    detector: GeneralizedRcnn,
    optimizer: Stepper,
    config: &'a TrainingConfig,
    pace: Pace,
    start: Instant,
    steps: Vec<StepRecord>,
    validations: Vec<ValidationRecord>,
    best: Option<(GeneralizedRcnn, ValidationRecord)>,
}

impl Run<'_> {
    fn run(
        mut self,
        batches: &mut Batches,
        examine: &mut dyn FnMut(&GeneralizedRcnn) -> Result<Vec<Outcome>, TrainingError>,
        observe: &mut dyn FnMut(&TrainingEvent) -> ControlFlow<()>,
    ) -> Result<Trained, TrainingError> {
        let mut step = 0;
        let ending = loop {
            if let Some(ending) = self.pace.ending(step, self.elapsed_secs()) {
                // The last steps have the lowest learning rate; without a look at them the best checkpoint is unknown.
                if self.validations.last().is_none_or(|record| record.steps_done < step) {
                    let _ = self.validate(step, examine, observe)?;
                }
                break ending;
            }
            let batch = batches.next(self.request(step))?;
            let interrupted = self.step(step, batch, observe)?.is_break();
            step += 1;
            if interrupted {
                break Ending::Interrupted;
            }
            let settings = &self.config.validation;
            if step >= settings.first && step.is_multiple_of(settings.every) {
                if self.validate(step, examine, observe)?.is_break() {
                    break Ending::Interrupted;
                }
                self.consider_early_stop(step);
            }
        };
        let elapsed_secs = self.elapsed_secs();
        let (detector, best) = self.best.ok_or(TrainingError::StoppedTooEarly { step })?;
        let history = History { steps: self.steps, validations: self.validations, best, ending, elapsed_secs };
        Ok(Trained { detector, history })
    }

    /// What the next step learns from.
    fn request(&self, step: usize) -> BatchRequest {
        match self.config.windows {
            Some(windows) if self.pace.progress(step, self.elapsed_secs()) < windows.share => {
                BatchRequest { step, view: View::Window, size: windows.batch_size }
            }
            _ => BatchRequest { step, view: View::Frame, size: self.config.batch_size },
        }
    }

    fn step(
        &mut self,
        step: usize,
        batch: Batch,
        observe: &mut dyn FnMut(&TrainingEvent) -> ControlFlow<()>,
    ) -> Result<ControlFlow<()>, TrainingError> {
        let learning_rate = self.config.schedule.learning_rate(self.pace.progress(step, self.elapsed_secs()));
        let losses = self.detector.losses(&batch.images, &batch.targets, step_seed(self.config.seed, step))?;
        let total = losses.total();
        let record = StepRecord { step, samples: batch.images.len(), learning_rate, losses: LossValues::from(&losses) };
        if !record.losses.total().is_finite() {
            return Err(TrainingError::Diverged { step, loss: record.losses.total(), learning_rate });
        }
        let gradients = GradientsParams::from_grads(total.backward(), &self.detector);
        self.detector = self.optimizer.step(learning_rate, self.detector.clone(), gradients);
        self.steps.push(record);
        let (planned_steps, elapsed_secs) = (self.pace.planned_steps(), self.elapsed_secs());
        Ok(observe(&TrainingEvent::Step { record, planned_steps, elapsed_secs }))
    }

    fn validate(
        &mut self,
        steps_done: usize,
        examine: &mut dyn FnMut(&GeneralizedRcnn) -> Result<Vec<Outcome>, TrainingError>,
        observe: &mut dyn FnMut(&TrainingEvent) -> ControlFlow<()>,
    ) -> Result<ControlFlow<()>, TrainingError> {
        let detector = self.detector.valid();
        let validation = Validation::from_outcomes(&examine(&detector)?);
        let record = ValidationRecord { steps_done, elapsed_secs: self.elapsed_secs(), validation };
        self.validations.push(record);
        // Of equals the later one: its learning rate was lower.
        if self.best.as_ref().is_none_or(|(_, best)| validation.merit() >= best.validation.merit()) {
            self.best = Some((detector, record));
        }
        Ok(observe(&TrainingEvent::Validated(record)))
    }

    fn consider_early_stop(&mut self, step: usize) {
        let (Some(early_stop), Some(last)) = (&self.config.early_stop, self.validations.last()) else { return };
        if early_stop.is_reached(&last.validation) {
            let elapsed_secs = self.elapsed_secs();
            self.pace.start_cool_down(step, elapsed_secs, early_stop.cool_down);
        }
    }

    fn elapsed_secs(&self) -> f64 {
        self.start.elapsed().as_secs_f64()
    }
}

/// A seed of its own for every step, far from those of its neighbours.
pub fn step_seed(seed: u64, step: usize) -> u64 {
    seed.wrapping_add((step as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15))
}
