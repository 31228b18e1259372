//! The orientation CNN's run: from crops to cross-entropy.

use std::ops::ControlFlow;
use std::time::Instant;

use burn::tensor::{Device, Tensor, TensorData};
use image::RgbImage;
use sdg_demonstration::Demonstration;
use sdg_kernels::log_softmax;
use sdg_orientation::{OrientationCnn, OrientationConfig, crop_batch};

use super::augmented::AugmentedCrops;
use super::config::OrientationTraining;
use super::labelled_crop::LabelledCrop;
use super::measured::AngleErrors;
use super::start::OrientationStart;
use crate::error::TrainingError;
use crate::optimizer::Stepper;
use crate::pace::Ending;
use crate::prefetch::{BatchRequest, Batches, with_batches};
use crate::run::{LossFigures, RunSettings, Step, Task, Validated, run};

/// Events of a run.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum OrientationEvent {
    /// A step was made.
    Step {
        /// Index of the step, from zero.
        step: usize,
        /// Number of steps of the run, as known now.
        planned_steps: usize,
        /// Cross-entropy before the update, in nats per crop.
        loss: f64,
        /// Seconds since the start of the run.
        elapsed_secs: f64,
    },
    /// The network was evaluated on the held-out crops.
    Validated {
        /// Steps done before.
        steps_done: usize,
        /// Errors of the angle on the held-out crops, in degrees.
        errors: AngleErrors,
        /// Seconds since the start of the run.
        elapsed_secs: f64,
    },
}

/// A trained network, without gradients, and the run that made it.
#[derive(Debug, Clone)]
pub struct TrainedOrientation {
    /// The network after the last step.
    pub network: OrientationCnn,
    /// The network's errors on held-out crops.
    pub errors: AngleErrors,
    /// Number of steps done.
    pub steps: usize,
    /// The reason for the run's end.
    pub ending: Ending,
    /// Seconds of the run, including validation.
    pub elapsed_secs: f64,
}

/// Number of crops from which classes are computed if a network starts from pretrained parameters.
const NUM_CLASS_CROPS: usize = 960;

/// Trains a network from demonstrations, from random values or from pretrained parameters.
///
/// `observe` is called after every step and every validation and may stop the run; the network is then returned as it
/// is, and its errors show whether it is useful.
///
/// # Errors
/// An invalid setting, the errors of [`AugmentedCrops::new`], pretrained parameters of another network, a loss that is
/// not finite.
pub fn teach(
    demonstrations: &[Demonstration],
    network: &OrientationConfig,
    start: Option<&OrientationStart>,
    training: &OrientationTraining,
    device: &Device,
    observe: &mut dyn FnMut(&OrientationEvent) -> ControlFlow<()>,
) -> Result<TrainedOrientation, TrainingError> {
    training.validate()?;
    let untaught = network.init(&device.clone().autodiff(), training.seed)?;
    let crops = AugmentedCrops::new(demonstrations, &training.crops, network.input_px, training.seed)?;
    let untaught = match start {
        Some(start) => {
            let views: Vec<LabelledCrop> =
                (0..).flat_map(|scene_idx| crops.scene(scene_idx)).take(NUM_CLASS_CROPS).collect();
            start.apply(untaught, &views)?
        }
        None => untaught,
    };
    let held_out: Vec<LabelledCrop> = (0..training.validation_crops as u64).filter_map(|i| crops.held_out(i)).collect();
    train(untaught, training, &|scene_idx| crops.scene(scene_idx), &held_out, observe)
}

/// Trains `network`, whose device carries autodiff, on the crops that `scene` returns for each scene index.
///
/// # Errors
/// An invalid setting, a loss that is not finite, or a crop whose size differs from the network's input.
pub fn train(
    network: OrientationCnn,
    training: &OrientationTraining,
    scene: &(dyn Fn(u64) -> Vec<LabelledCrop> + Sync),
    held_out: &[LabelledCrop],
    observe: &mut dyn FnMut(&OrientationEvent) -> ControlFlow<()>,
) -> Result<TrainedOrientation, TrainingError> {
    training.validate()?;
    let start = Instant::now();
    let optimizer = Stepper::composed_adamw(training.weight_decay, training.max_gradient_norm);
    let settings = RunSettings {
        steps: training.steps,
        time_budget: training.time_budget,
        schedule: training.schedule,
        validations: None,
    };
    // The number of crops of a scene depends on the part's visibility, so a batch depends on the batches before it.
    let mut crops = (0..).flat_map(scene);
    let prepare = |_: BatchRequest<()>| Ok(crops.by_ref().take(training.batch_size).collect());
    with_batches(prepare, |batches| {
        let mut task = OrientationTask { training, batches, held_out, observe, errors: None };
        let ended = run(&mut task, network, optimizer, &settings, start)?;
        let errors = match task.errors.take() {
            Some(errors) => errors,
            // The run was interrupted, so the network was not measured yet.
            None => task.measure(&ended.network, ended.steps, start)?.0,
        };
        let elapsed_secs = start.elapsed().as_secs_f64();
        Ok(TrainedOrientation {
            network: ended.network,
            errors,
            steps: ended.steps,
            ending: ended.ending,
            elapsed_secs,
        })
    })
}

struct OrientationTask<'a> {
    training: &'a OrientationTraining,
    batches: &'a mut Batches<(), Vec<LabelledCrop>>,
    held_out: &'a [LabelledCrop],
    observe: &'a mut dyn FnMut(&OrientationEvent) -> ControlFlow<()>,
    /// Errors of the network after the last step.
    errors: Option<AngleErrors>,
}

impl OrientationTask<'_> {
    fn measure(
        &mut self,
        network: &OrientationCnn,
        steps_done: usize,
        start: Instant,
    ) -> Result<(AngleErrors, ControlFlow<()>), TrainingError> {
        let errors = AngleErrors::measure(network, self.held_out)?;
        let elapsed_secs = start.elapsed().as_secs_f64();
        let event = OrientationEvent::Validated { steps_done, errors: errors.clone(), elapsed_secs };
        Ok((errors, (self.observe)(&event)))
    }
}

/// Cross-entropy, in nats per crop.
#[derive(Clone, Copy)]
struct CrossEntropy(f64);

impl LossFigures for CrossEntropy {
    const NAME: &'static str = "orientation loss";

    fn total(&self) -> f64 {
        self.0
    }
}

impl Task for OrientationTask<'_> {
    type Network = OrientationCnn;
    type Batch = Vec<LabelledCrop>;
    type Losses = CrossEntropy;

    fn batch(&mut self, step: usize, _progress: f64) -> Result<Vec<LabelledCrop>, TrainingError> {
        self.batches.next(BatchRequest { step, kind: () })
    }

    fn losses(
        &self,
        network: &OrientationCnn,
        batch: &Vec<LabelledCrop>,
        _step: usize,
    ) -> Result<(Tensor<1>, CrossEntropy), TrainingError> {
        let loss = cross_entropy(network, batch, self.training);
        let value = CrossEntropy(f64::from(loss.clone().into_scalar::<f32>()));
        Ok((loss, value))
    }

    fn after_step(&mut self, made: &Step<'_, Self>) -> ControlFlow<()> {
        let &Step { step, planned_steps, losses: CrossEntropy(loss), elapsed_secs, .. } = made;
        (self.observe)(&OrientationEvent::Step { step, planned_steps, loss, elapsed_secs })
    }

    fn validate(
        &mut self,
        network: OrientationCnn,
        steps_done: usize,
        start: Instant,
    ) -> Result<Validated, TrainingError> {
        let (errors, flow) = self.measure(&network, steps_done, start)?;
        self.errors = Some(errors);
        Ok(Validated { cool_down: None, flow })
    }
}

/// The mean cross-entropy of a batch, a scalar `[1]`.
fn cross_entropy(network: &OrientationCnn, batch: &[LabelledCrop], training: &OrientationTraining) -> Tensor<1> {
    let classes = network.config().classes;
    let device = network.device();
    let crops: Vec<RgbImage> = batch.iter().map(|one| one.crop.clone()).collect();
    let targets: Vec<f32> = batch.iter().flat_map(|one| classes.targets(one.angle, training.labels)).collect();
    let targets = Tensor::<2>::from_data(TensorData::new(targets, [batch.len(), classes.num_classes]), &device);
    let logits = network.forward(crop_batch(&crops, &device));
    (targets * log_softmax(logits)).sum().neg() / batch.len() as f32
}
