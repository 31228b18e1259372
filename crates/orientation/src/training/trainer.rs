//! The loop: crops, cross-entropy, gradients, step; now and then a validation.

use std::ops::ControlFlow;
use std::sync::mpsc;
use std::time::Instant;

use burn::grad_clipping::GradientClippingConfig;
use burn::module::Module;
use burn::optim::{AdamWConfig, GradientsParams};
use burn::tensor::{Device, Tensor, TensorData, activation};
use image::RgbImage;
use sdg_demonstration::Demonstration;
use sdg_training::{Ending, Pace};

use super::augmented::{AugmentedCrops, LabelledCrop};
use super::config::OrientationTraining;
use super::measured::AngleErrors;
use super::start::OrientationStart;
use crate::config::OrientationConfig;
use crate::error::{OrientationError, Result};
use crate::network::{OrientationCnn, crop_batch};

/// Batches that wait ready: one in use, one ready, one in the making.
const READY: usize = 2;

/// What happens during a run.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum OrientationEvent {
    /// A step was made.
    Step {
        /// From zero.
        step: usize,
        /// Steps that the run will have, as known now.
        planned_steps: usize,
        /// Cross-entropy before the update, in nats a crop.
        loss: f64,
        /// Since the start of the run.
        elapsed_secs: f64,
    },
    /// The network was shown the held-back crops.
    Validated {
        /// Steps done before.
        steps_done: usize,
        /// How far it was off.
        errors: AngleErrors,
        /// Since the start of the run.
        elapsed_secs: f64,
    },
}

/// A taught network, without gradients, and the run that made it.
#[derive(Debug, Clone)]
pub struct TrainedOrientation {
    /// The network after the last step.
    pub network: OrientationCnn,
    /// How far it is off on held-back crops.
    pub errors: AngleErrors,
    /// Steps made.
    pub steps: usize,
    /// Why the run ended.
    pub ending: Ending,
    /// How long it took, validation included.
    pub elapsed_secs: f64,
}

/// Crops that classes are made from where a network starts from pretrained parameters.
const NUM_CLASS_CROPS: usize = 960;

/// Teaches a network from demonstrations, from nothing or from pretrained parameters.
///
/// `observe` is called after every step and every validation and may end the run; the network is then returned as it is, and
/// its errors say whether it is of any use.
///
/// # Errors
/// A setting that cannot be, a demonstration without a grasp line, a loss that is not finite.
pub fn teach(
    demonstrations: &[Demonstration],
    network: &OrientationConfig,
    start: Option<&OrientationStart>,
    training: &OrientationTraining,
    device: &Device,
    observe: &mut dyn FnMut(&OrientationEvent) -> ControlFlow<()>,
) -> Result<TrainedOrientation> {
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

/// Trains `network`, whose device carries autodiff, on the crops that `scene` gives by the scene's index.
///
/// # Errors
/// As [`teach`], and a crop of another size than the network's input.
pub fn train(
    mut network: OrientationCnn,
    training: &OrientationTraining,
    scene: &(dyn Fn(u64) -> Vec<LabelledCrop> + Sync),
    held_out: &[LabelledCrop],
    observe: &mut dyn FnMut(&OrientationEvent) -> ControlFlow<()>,
) -> Result<TrainedOrientation> {
    training.validate()?;
    let start = Instant::now();
    let mut optimizer = AdamWConfig::new()
        .with_weight_decay(training.weight_decay as f32)
        .with_epsilon(1e-8)
        .with_grad_clipping(Some(GradientClippingConfig::Norm(training.max_gradient_norm)))
        .init();
    let mut pace = Pace::new(training.steps, training.time_budget.map(|budget| budget.as_secs_f64()));
    with_batches(training.batch_size, scene, |next| {
        let mut step = 0;
        let ending = loop {
            let elapsed_secs = start.elapsed().as_secs_f64();
            if let Some(ending) = pace.ending(step, elapsed_secs) {
                break ending;
            }
            let learning_rate = training.schedule.learning_rate(pace.progress(step, elapsed_secs));
            let loss = cross_entropy(&network, &next(), training);
            let value = f64::from(loss.clone().into_scalar::<f32>());
            if !value.is_finite() {
                return Err(OrientationError::Diverged { step, loss: value, learning_rate });
            }
            let gradients = GradientsParams::from_grads(loss.backward(), &network);
            network = optimizer.step(learning_rate, network, gradients);
            let event = OrientationEvent::Step { step, planned_steps: pace.planned_steps(), loss: value, elapsed_secs };
            step += 1;
            if observe(&event).is_break() {
                break Ending::Interrupted;
            }
            let Some(early_stop) = training.early_stop.filter(|stop| step.is_multiple_of(stop.every)) else { continue };
            if step >= pace.planned_steps() {
                continue;
            }
            let errors = AngleErrors::measure(&network.valid(), held_out)?;
            let elapsed_secs = start.elapsed().as_secs_f64();
            if early_stop.is_reached(&errors) {
                pace.start_cool_down(step, elapsed_secs, early_stop.cool_down);
            }
            if observe(&OrientationEvent::Validated { steps_done: step, errors, elapsed_secs }).is_break() {
                break Ending::Interrupted;
            }
        };
        let network = network.valid();
        let errors = AngleErrors::measure(&network, held_out)?;
        let elapsed_secs = start.elapsed().as_secs_f64();
        // The run is over: there is nothing left to interrupt.
        let _ = observe(&OrientationEvent::Validated { steps_done: step, errors: errors.clone(), elapsed_secs });
        Ok(TrainedOrientation { network, errors, steps: step, ending, elapsed_secs })
    })
}

/// The mean cross-entropy of a batch, a scalar `[1]`.
fn cross_entropy(network: &OrientationCnn, batch: &[LabelledCrop], training: &OrientationTraining) -> Tensor<1> {
    let classes = network.config().classes;
    let device = network.device();
    let crops: Vec<RgbImage> = batch.iter().map(|one| one.crop.clone()).collect();
    let targets: Vec<f32> = batch.iter().flat_map(|one| classes.targets(one.angle, training.labels)).collect();
    let targets = Tensor::<2>::from_data(TensorData::new(targets, [batch.len(), classes.num_classes]), &device);
    let logits = network.forward(crop_batch(&crops, &device));
    (targets * activation::log_softmax(logits, 1)).sum().neg() / batch.len() as f32
}

/// Runs `consume` while another thread prepares batches. The thread ends with `consume`.
fn with_batches<T>(
    size: usize,
    scene: &(dyn Fn(u64) -> Vec<LabelledCrop> + Sync),
    consume: impl FnOnce(&mut dyn FnMut() -> Vec<LabelledCrop>) -> T,
) -> T {
    std::thread::scope(|scope| {
        let (sender, receiver) = mpsc::sync_channel(READY);
        scope.spawn(move || {
            let mut crops = (0..).flat_map(scene);
            // An error means that nobody waits any more.
            while sender.send(crops.by_ref().take(size).collect()).is_ok() {}
        });
        let mut next = || match receiver.recv() {
            Ok(batch) => batch,
            // The thread outlives the receiver unless it panics, and the scope raises its panic again.
            Err(mpsc::RecvError) => panic!("the thread that prepares batches ended"),
        };
        let result = consume(&mut next);
        drop(receiver);
        result
    })
}
