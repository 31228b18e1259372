//! The loop that trains the detector and the orientation CNN: batch, loss, gradients, step, and sometimes a validation.
//!
//! A [`Task`] defines the training; the loop handles only the order, the learning rate and the end of a run.

use std::ops::ControlFlow;
use std::time::{Duration, Instant};

use burn::module::Module;
use burn::optim::GradientsParams;
use burn::tensor::Tensor;

use crate::error::TrainingError;
use crate::optimizer::Stepper;
use crate::pace::{Ending, Pace};
use crate::schedule::OneCycle;

/// A network and its training data.
pub(crate) trait Task {
    /// The network, on a device that carries autodiff during training.
    type Network: Module;
    /// The data of a step.
    type Batch;
    /// The figures of a step's loss.
    type Losses: LossFigures;

    /// The batch of a step at `progress` of the run, in [0, 1].
    ///
    /// # Errors
    /// A sample that the network rejects.
    fn batch(&mut self, step: usize, progress: f64) -> Result<Self::Batch, TrainingError>;

    /// The loss to minimise, a scalar `[1]`, and its figures.
    ///
    /// # Errors
    /// A batch that the network rejects.
    fn losses(
        &self,
        network: &Self::Network,
        batch: &Self::Batch,
        step: usize,
    ) -> Result<(Tensor<1>, Self::Losses), TrainingError>;

    /// Called after a step; may stop the run.
    fn after_step(&mut self, step: &Step<'_, Self>) -> ControlFlow<()>;

    /// Measures the network, without gradients, after some steps.
    ///
    /// # Errors
    /// Held-out samples that cannot be examined.
    fn validate(
        &mut self,
        network: Self::Network,
        steps_done: usize,
        start: Instant,
    ) -> Result<Validated, TrainingError>;
}

/// Values of a loss, read from the device.
pub(crate) trait LossFigures: Copy {
    /// Name in messages.
    const NAME: &'static str;

    /// The loss that is minimised.
    fn total(&self) -> f64;
}

/// A step that was made.
pub(crate) struct Step<'a, T: Task + ?Sized> {
    /// Index of the step, from zero.
    pub(crate) step: usize,
    pub(crate) batch: &'a T::Batch,
    pub(crate) learning_rate: f64,
    /// Losses before the update.
    pub(crate) losses: T::Losses,
    /// Number of steps of the run, as known now.
    pub(crate) planned_steps: usize,
    /// Seconds since the start of the run.
    pub(crate) elapsed_secs: f64,
}

/// The decision of a validation.
pub(crate) struct Validated {
    /// Number of steps from here to the end of the run, if the network is good enough.
    pub(crate) cool_down: Option<usize>,
    /// Whether the run continues.
    pub(crate) flow: ControlFlow<()>,
}

/// The settings that a loop needs.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RunSettings {
    /// Optimiser steps, unless early stop or the time budget ends the run earlier.
    pub(crate) steps: usize,
    /// Wall-clock time for the whole run.
    pub(crate) time_budget: Option<Duration>,
    /// Learning rate over the run.
    pub(crate) schedule: OneCycle,
    /// When to validate, besides at the end.
    pub(crate) validations: Option<ValidationSteps>,
}

/// The steps after which a network is validated.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ValidationSteps {
    /// No validation before this step.
    pub(crate) first: usize,
    /// Steps between validations.
    pub(crate) every: usize,
}

impl ValidationSteps {
    fn include(&self, steps_done: usize) -> bool {
        steps_done >= self.first && steps_done.is_multiple_of(self.every)
    }
}

/// Result of a run.
pub(crate) struct Ended<N> {
    /// The network after the last step, without autodiff.
    pub(crate) network: N,
    /// Number of steps done.
    pub(crate) steps: usize,
    pub(crate) ending: Ending,
}

/// Trains a network. A run that is not interrupted ends with a validation.
///
/// # Errors
/// A loss that is not finite, and the errors of the task.
pub(crate) fn run<T: Task>(
    task: &mut T,
    mut network: T::Network,
    mut optimizer: Stepper,
    settings: &RunSettings,
    start: Instant,
) -> Result<Ended<T::Network>, TrainingError> {
    let elapsed_secs = || start.elapsed().as_secs_f64();
    let mut pace = Pace::new(settings.steps, settings.time_budget.map(|budget| budget.as_secs_f64()));
    let (mut step, mut validated_at) = (0, None);
    let ending = loop {
        if let Some(ending) = pace.ending(step, elapsed_secs()) {
            // The last steps have the lowest learning rate: their effect on the network is not known yet.
            if validated_at != Some(step) {
                task.validate(network.valid(), step, start)?;
            }
            break ending;
        }
        let batch = task.batch(step, pace.progress(step, elapsed_secs()))?;
        let learning_rate = settings.schedule.learning_rate(pace.progress(step, elapsed_secs()));
        let (total, losses) = task.losses(&network, &batch, step)?;
        if !losses.total().is_finite() {
            return Err(TrainingError::Diverged { name: T::Losses::NAME, step, loss: losses.total(), learning_rate });
        }
        let gradients = GradientsParams::from_grads(total.backward(), &network);
        network = optimizer.step(learning_rate, network, gradients);
        let (planned_steps, elapsed_secs) = (pace.planned_steps(), elapsed_secs());
        let made = Step { step, batch: &batch, learning_rate, losses, planned_steps, elapsed_secs };
        let flow = task.after_step(&made);
        step += 1;
        if flow.is_break() {
            break Ending::Interrupted;
        }
        if settings.validations.is_some_and(|steps| steps.include(step)) {
            let Validated { cool_down, flow } = task.validate(network.valid(), step, start)?;
            validated_at = Some(step);
            if flow.is_break() {
                break Ending::Interrupted;
            }
            if let Some(length) = cool_down {
                pace.start_cool_down(step, start.elapsed().as_secs_f64(), length);
            }
        }
    };
    Ok(Ended { network: network.valid(), steps: step, ending })
}
