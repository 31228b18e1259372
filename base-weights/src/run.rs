//! A pretraining run: pictures, losses, gradients, steps, checkpoints. A [`Task`] provides the parts that depend on
//! the network.

use std::path::Path;

use anyhow::{Result, bail};
use burn::module::Module;
use burn::optim::GradientsParams;
use burn::tensor::{Device, Tensor};
use sdg_layers::state_dict;
use sdg_training::{AdamW, OneCycle};
use serde::{Deserialize, Serialize};

use crate::checkpoint::Checkpoint;

/// Decoupled weight decay, as in teaching.
const WEIGHT_DECAY: f64 = 1e-4;
/// Norm to which each parameter's gradient is clipped, as in teaching.
const MAX_GRADIENT_NORM: f64 = 10.0;

/// The settings that determine a run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// Determines parts, pictures and every random choice.
    pub seed: u64,
    /// Number of generated parts.
    pub num_parts: usize,
    /// Pictures per step.
    pub batch_size: usize,
    /// Number of steps of the whole run.
    pub steps: usize,
    /// Learning rate over the run.
    pub schedule: OneCycle,
}

impl Settings {
    /// The settings of `make base-weights`, with these numbers of parts and steps.
    pub fn new(seed: u64, num_parts: usize, steps: usize) -> Self {
        Self { seed, num_parts, batch_size: 5, steps, schedule: OneCycle { peak: 1e-3, warm_up: 0.1 } }
    }
}

/// The network and losses of a pretraining run.
pub trait Task: Sized {
    /// The module that is pretrained; the optimiser updates all its parameters.
    type Network: Module + Clone;

    /// Initialises the network at random, on a device with autodiff.
    ///
    /// # Errors
    /// A configuration that contradicts itself.
    fn network(&self, settings: &Settings, device: &Device) -> Result<Self::Network>;

    /// The losses of a step, by name; the run minimises their sum.
    ///
    /// # Errors
    /// A picture that the network rejects.
    fn losses(
        &self,
        network: &Self::Network,
        settings: &Settings,
        step: usize,
    ) -> Result<Vec<(&'static str, Tensor<1>)>>;
}

/// A run and its current state.
pub struct Run<T: Task> {
    task: T,
    settings: Settings,
    network: T::Network,
    optimizer: AdamW,
    step: usize,
}

impl<T: Task> Run<T> {
    /// Starts a run; `device` is without autodiff.
    ///
    /// # Errors
    /// The errors of [`Task::network`].
    pub fn start(task: T, settings: Settings, device: &Device) -> Result<Self> {
        let network = task.network(&settings, &device.clone().autodiff())?;
        Ok(Self { task, settings, network, optimizer: AdamW::new(WEIGHT_DECAY, MAX_GRADIENT_NORM), step: 0 })
    }

    /// Resumes a run from a checkpoint.
    ///
    /// # Errors
    /// A checkpoint of another network.
    pub fn resume(task: T, checkpoint: &Checkpoint<Settings>, device: &Device) -> Result<Self> {
        let fresh = Self::start(task, checkpoint.settings.clone(), device)?;
        let (network, report) = state_dict::import(fresh.network, &checkpoint.parameters);
        if !report.is_complete() {
            bail!(
                "expected a checkpoint of this network, found {} parameters missing, {} of a different shape and {} unexpected",
                report.missing.len(),
                report.mismatched.len(),
                report.unused.len()
            );
        }
        let optimizer = fresh.optimizer.with_state(&network, &checkpoint.optimizer);
        Ok(Self { network, optimizer, step: checkpoint.step, ..fresh })
    }

    /// Resumes from the checkpoint at a path, or starts a run if the file does not exist.
    ///
    /// # Errors
    /// A file that is not a checkpoint, or a checkpoint of another network or of a run with other settings.
    pub fn start_or_resume(task: T, path: &Path, settings: Settings, device: &Device) -> Result<Self> {
        if !path.exists() {
            return Self::start(task, settings, device);
        }
        let checkpoint = Checkpoint::<Settings>::read(path)?;
        if checkpoint.settings != settings {
            bail!("{}: expected a run of {settings:?}, found one of {:?}", path.display(), checkpoint.settings);
        }
        Self::resume(task, &checkpoint, device)
    }

    /// Number of steps done.
    pub fn step(&self) -> usize {
        self.step
    }

    /// Whether all steps are done.
    pub fn is_over(&self) -> bool {
        self.step >= self.settings.steps
    }

    /// The state from which a later run resumes.
    pub fn checkpoint(&self) -> Checkpoint<Settings> {
        Checkpoint {
            settings: self.settings.clone(),
            step: self.step,
            parameters: state_dict::export(&self.network),
            optimizer: self.optimizer.state(&self.network),
        }
    }

    /// Does one step and returns its losses.
    ///
    /// # Errors
    /// A loss that is not finite; the errors of [`Task::losses`].
    pub fn advance(&mut self) -> Result<Vec<(&'static str, f64)>> {
        let losses = self.task.losses(&self.network, &self.settings, self.step)?;
        let value = |loss: &Tensor<1>| f64::from(loss.clone().into_scalar::<f32>());
        let values: Vec<(&str, f64)> = losses.iter().map(|(name, loss)| (*name, value(loss))).collect();
        if values.iter().any(|(_, value)| !value.is_finite()) {
            bail!("step {}: expected finite losses, found {values:?}", self.step);
        }
        let total = losses.into_iter().map(|(_, loss)| loss).reduce(|sum, loss| sum + loss);
        if let Some(total) = total {
            let gradients = GradientsParams::from_grads(total.backward(), &self.network);
            let learning_rate = self.settings.schedule.learning_rate(self.step as f64 / self.settings.steps as f64);
            self.network = self.optimizer.step(learning_rate, self.network.clone(), gradients);
        }
        self.step += 1;
        Ok(values)
    }
}
