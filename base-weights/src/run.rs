//! A pretraining run: pictures, losses, gradients, steps, checkpoints. What differs between networks is a [`Task`].

use std::path::Path;

use anyhow::{Result, bail};
use burn::module::Module;
use burn::optim::GradientsParams;
use burn::tensor::{Device, Tensor};
use sdg_layers::state_dict;
use sdg_training::{AdamW, OneCycle};
use serde::{Deserialize, Serialize};

use crate::checkpoint::Checkpoint;

/// Decoupled weight decay and the norm that each parameter's gradient is cut to, as teaching has them.
const WEIGHT_DECAY: f64 = 1e-4;
const MAX_GRADIENT_NORM: f64 = 10.0;

/// What decides a run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// Decides parts, pictures and every random choice.
    pub seed: u64,
    /// Parts that are drawn from.
    pub num_parts: usize,
    /// Pictures a step.
    pub batch_size: usize,
    /// Steps of the whole run.
    pub steps: usize,
    /// Learning rate over the run.
    pub schedule: OneCycle,
}

impl Settings {
    /// The run of `make base-weights` with so many parts and steps.
    pub fn new(seed: u64, num_parts: usize, steps: usize) -> Self {
        Self { seed, num_parts, batch_size: 5, steps, schedule: OneCycle { peak: 1e-3, warm_up: 0.1 } }
    }
}

/// What a network learns.
pub trait Task: Sized {
    /// The module that is pretrained, all of whose parameters the optimiser updates.
    type Network: Module + Clone;

    /// Draws the network, on a device that carries autodiff.
    ///
    /// # Errors
    /// A configuration that contradicts itself.
    fn network(&self, settings: &Settings, device: &Device) -> Result<Self::Network>;

    /// The losses of a step by their names; their sum is descended.
    ///
    /// # Errors
    /// A picture that the network refuses.
    fn losses(
        &self,
        network: &Self::Network,
        settings: &Settings,
        step: usize,
    ) -> Result<Vec<(&'static str, Tensor<1>)>>;
}

/// A run and where it is.
pub struct Run<T: Task> {
    task: T,
    settings: Settings,
    network: T::Network,
    optimizer: AdamW,
    step: usize,
}

impl<T: Task> Run<T> {
    /// Starts a run; `device` is without gradients.
    ///
    /// # Errors
    /// As [`Task::network`].
    pub fn start(task: T, settings: Settings, device: &Device) -> Result<Self> {
        let network = task.network(&settings, &device.clone().autodiff())?;
        Ok(Self { task, settings, network, optimizer: AdamW::new(WEIGHT_DECAY, MAX_GRADIENT_NORM), step: 0 })
    }

    /// Goes on from a checkpoint.
    ///
    /// # Errors
    /// A checkpoint of another network.
    pub fn resume(task: T, checkpoint: &Checkpoint<Settings>, device: &Device) -> Result<Self> {
        let fresh = Self::start(task, checkpoint.settings.clone(), device)?;
        let (network, report) = state_dict::import(fresh.network, &checkpoint.parameters);
        if !report.is_complete() {
            bail!(
                "expected a checkpoint of this network, found {} parameters missing, {} of another shape and {} of none",
                report.missing.len(),
                report.mismatched.len(),
                report.unused.len()
            );
        }
        let optimizer = fresh.optimizer.with_state(&network, &checkpoint.optimizer);
        Ok(Self { network, optimizer, step: checkpoint.step, ..fresh })
    }

    /// Reads the checkpoint at a path and goes on, or starts a run where there is none.
    ///
    /// # Errors
    /// A checkpoint of other settings.
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

    /// Steps done.
    pub fn step(&self) -> usize {
        self.step
    }

    /// Whether all steps are done.
    pub fn is_over(&self) -> bool {
        self.step >= self.settings.steps
    }

    /// What a later run goes on from.
    pub fn checkpoint(&self) -> Checkpoint<Settings> {
        Checkpoint {
            settings: self.settings.clone(),
            step: self.step,
            parameters: state_dict::export(&self.network),
            optimizer: self.optimizer.state(&self.network),
        }
    }

    /// Does one step; gives its losses.
    ///
    /// # Errors
    /// A loss that is not finite.
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
