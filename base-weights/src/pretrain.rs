//! The run: pictures, losses, gradients, steps; checkpoints; what teaching starts from in the end.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use anyhow::{Context, Result, bail};
use burn::optim::GradientsParams;
use burn::tensor::Device;
use rayon::prelude::*;
use sdg_detection::ResizedTarget;
use sdg_detection::config::RcnnConfig;
use sdg_detection::{TransformedImage, state_dict};
use sdg_grasp::BaseWeightsFile;
use sdg_training::{AdamW, LossValues, OneCycle};
use serde::{Deserialize, Serialize};

use crate::checkpoint::Checkpoint;
use crate::network::{PretrainNetwork, pretrain_config};
use crate::pictures::Pictures;

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

/// A run and where it is.
pub struct Run {
    settings: Settings,
    pictures: Pictures,
    network: PretrainNetwork,
    optimizer: AdamW,
    step: usize,
}

impl Run {
    /// Starts a run of the network `config`; `device` is without gradients.
    ///
    /// # Errors
    /// A configuration that contradicts itself.
    pub fn start(settings: Settings, config: &RcnnConfig, device: &Device) -> Result<Self> {
        let network = PretrainNetwork::init(config, &device.clone().autodiff(), settings.seed)?;
        let pictures = Pictures::new(settings.num_parts, config, settings.seed)?;
        Ok(Self { settings, pictures, network, optimizer: AdamW::new(WEIGHT_DECAY, MAX_GRADIENT_NORM), step: 0 })
    }

    /// Goes on from a checkpoint.
    ///
    /// # Errors
    /// A checkpoint of another network.
    pub fn resume(checkpoint: &Checkpoint<Settings>, config: &RcnnConfig, device: &Device) -> Result<Self> {
        let fresh = Self::start(checkpoint.settings.clone(), config, device)?;
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
    pub fn advance(&mut self) -> Result<LossValues> {
        let (images, targets) = self.batch()?;
        let seed = self.settings.seed.wrapping_add((self.step as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15));
        let losses = self.network.losses(&images, &targets, seed);
        let values = LossValues::from(&losses);
        if !values.total().is_finite() {
            bail!("step {}: expected a finite loss, found {values:?}", self.step);
        }
        let gradients = GradientsParams::from_grads(losses.total().backward(), &self.network);
        let learning_rate = self.settings.schedule.learning_rate(self.step as f64 / self.settings.steps as f64);
        self.network = self.optimizer.step(learning_rate, self.network.clone(), gradients);
        self.step += 1;
        Ok(values)
    }

    fn batch(&self) -> Result<(Vec<TransformedImage>, Vec<ResizedTarget>)> {
        let first = (self.step * self.settings.batch_size) as u64;
        let indices = first..first + self.settings.batch_size as u64;
        let group = self.pictures.group(self.step);
        let pictures: Vec<_> = indices.into_par_iter().map(|i| self.pictures.picture(&group, i)).collect::<Result<_>>()?;
        Ok(pictures.into_iter().unzip())
    }
}

/// What teaching starts from: the trunk and all heads of the preset but what knows one part from another.
///
/// # Errors
/// A checkpoint without the heads of the preset.
pub fn export(checkpoint: &Checkpoint<Settings>, commit: &str) -> Result<BaseWeightsFile> {
    let wanted = state_dict::export(&pretrain_config().init_blank(&Device::flex())?);
    let anew = |name: &str| name.contains("box_predictor.cls_score.");
    let mut parameters = BTreeMap::new();
    let mut reinitialized = BTreeSet::new();
    for (name, blank) in wanted {
        if anew(&name) {
            reinitialized.insert(name);
            continue;
        }
        let key = format!("detector.{name}");
        let found =
            checkpoint.parameters.get(&key).with_context(|| format!("expected {key} in the checkpoint"))?.clone();
        if found.shape != blank.shape {
            bail!("{key}: expected shape {:?}, found {:?}", blank.shape, found.shape);
        }
        parameters.insert(name, found);
    }
    let imprint = checkpoint.parameters.iter().filter(|(name, _)| name.starts_with("imprint."));
    parameters.extend(imprint.map(|(name, tensor)| (name.clone(), tensor.clone())));
    let Settings { seed, num_parts, batch_size, .. } = checkpoint.settings;
    let origin = BTreeMap::from([
        ("commit".to_owned(), commit.to_owned()),
        ("seed".to_owned(), seed.to_string()),
        ("steps".to_owned(), checkpoint.step.to_string()),
        ("parts".to_owned(), num_parts.to_string()),
        ("pictures".to_owned(), (checkpoint.step * batch_size).to_string()),
        ("licence".to_owned(), "MIT OR Apache-2.0".to_owned()),
    ]);
    Ok(BaseWeightsFile { preset: "edge".into(), reinitialized, parameters, origin })
}

/// Reads the checkpoint at a path and goes on, or starts a run where there is none.
///
/// # Errors
/// A checkpoint of other settings.
pub fn start_or_resume(path: &Path, settings: Settings, device: &Device) -> Result<Run> {
    let config = pretrain_config();
    if !path.exists() {
        return Run::start(settings, &config, device);
    }
    let checkpoint = Checkpoint::<Settings>::read(path)?;
    if checkpoint.settings != settings {
        bail!("{}: expected a run of {settings:?}, found one of {:?}", path.display(), checkpoint.settings);
    }
    Run::resume(&checkpoint, &config, device)
}
