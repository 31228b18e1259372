//! The detector's task: pictures of several parts, each identified by other views of it.

use anyhow::Result;
use burn::tensor::{Device, Tensor};
use rayon::prelude::*;
use sdg_detection::RcnnConfig;
use sdg_training::step_seed;

use crate::network::PretrainNetwork;
use crate::pictures::Pictures;
use crate::run::{Settings, Task};

/// Pretraining of the detector of a configuration; see [`crate::network`].
pub struct DetectorTask {
    config: RcnnConfig,
    pictures: Pictures,
}

impl DetectorTask {
    /// Prepares the pictures of a run for a network.
    ///
    /// # Errors
    /// Settings that the generator rejects.
    pub fn new(settings: &Settings, config: RcnnConfig) -> Result<Self> {
        Ok(Self { pictures: Pictures::new(settings.num_parts, &config, settings.seed)?, config })
    }
}

impl Task for DetectorTask {
    type Network = PretrainNetwork;

    fn network(&self, settings: &Settings, device: &Device) -> Result<PretrainNetwork> {
        Ok(PretrainNetwork::init(&self.config, device, settings.seed)?)
    }

    fn losses(
        &self,
        network: &PretrainNetwork,
        settings: &Settings,
        step: usize,
    ) -> Result<Vec<(&'static str, Tensor<1>)>> {
        let first = (step * settings.batch_size) as u64;
        let group = self.pictures.group(step);
        let batch: Vec<_> = (first..first + settings.batch_size as u64)
            .into_par_iter()
            .map(|i| self.pictures.picture(&group, i))
            .collect::<Result<_>>()?;
        let (images, targets): (Vec<_>, Vec<_>) = batch.into_iter().unzip();
        let losses = network.losses(&images, &targets, step_seed(settings.seed, step));
        let always = [
            ("rpn_cls", losses.rpn_cls),
            ("rpn_loc", losses.rpn_loc),
            ("cls", losses.cls),
            ("box_reg", losses.box_reg),
        ];
        let heads = [("keypoint", losses.keypoint), ("mask", losses.mask)];
        Ok(always.into_iter().chain(heads.into_iter().filter_map(|(name, loss)| Some((name, loss?)))).collect())
    }
}
