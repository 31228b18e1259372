//! The options of a teaching.

use std::ops::RangeInclusive;
use std::time::Duration;

use burn::tensor::Device;
use image::RgbImage;
use sdg_detection::RcnnConfig;
use sdg_geometry::RotationalSymmetry;

use super::fine_tuning::FineTuning;
use super::preset::Preset;
use super::start::Start;
use crate::check_config::CheckConfig;
use crate::error::Result;
use crate::facts::ModelKind;
use crate::lengths::Lengths;
use crate::region::SearchRegion;

/// How to teach.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct TeachOptions {
    /// The grasp model to teach.
    pub kind: ModelKind,
    /// Which network and training; without effect on model S, which has neither.
    pub preset: Preset,
    /// Decides every random choice.
    pub seed: u64,
    /// Wall-clock time for the training.
    pub time_budget: Option<Duration>,
    /// Steps of the detector other than the preset's, with the orientation CNN's in proportion; for tests and trials.
    pub steps: Option<usize>,
    /// How to teach; `None` for the preset's way from nothing, and for [`FineTuning::new`] from base weights of our own.
    pub fine_tuning: Option<FineTuning>,
    /// Turns of the part that look the same: they are neither taught nor held against the model.
    pub symmetry: RotationalSymmetry,
    /// Sizes over the nominal one at which the part is looked for.
    pub size_tolerance: RangeInclusive<f64>,
    /// The part of pictures that the model searches; teaching itself does not go by it.
    pub region: Option<SearchRegion>,
    /// What [`crate::seen_from_above`] says where the demonstrations come from there.
    pub lengths: Option<Lengths>,
    /// The user's pictures without the part: some of the samples of a network, and what the score is calibrated on. Each counts
    /// once; none is a background of other samples.
    pub negatives: Vec<RgbImage>,
    /// What the networks start from.
    pub start: Start,
    /// Where to compute; without gradients.
    pub device: Device,
}

impl TeachOptions {
    /// Model C with the default preset on the default device.
    pub fn new(seed: u64) -> Self {
        Self {
            kind: ModelKind::C,
            preset: Preset::default(),
            seed,
            time_budget: None,
            steps: None,
            fine_tuning: None,
            symmetry: RotationalSymmetry::None,
            size_tolerance: CheckConfig::DEFAULT_SIZE_TOLERANCE,
            region: None,
            lengths: None,
            negatives: Vec::new(),
            start: Start::default(),
            device: Device::flex(),
        }
    }

    /// The detector that is taught, which weights to start from must fit; `None` for model S, which has none.
    pub fn network(&self) -> Option<RcnnConfig> {
        self.preset.detector(self.kind, true).map(|detector| detector.network)
    }

    /// The detector while it is taught, which may have more heads than the model: what base weights of ours are read for.
    pub fn taught_network(&self) -> Option<RcnnConfig> {
        self.preset.detector(self.kind, true).map(|detector| detector.taught())
    }

    /// The same with the shipped weights read, where these options ask for them.
    ///
    /// # Errors
    /// [`GraspError::NeedsBaseWeights`](crate::GraspError::NeedsBaseWeights) where the preset starts from weights and
    /// this build carries none.
    pub(super) fn with_start_read(&self) -> Result<Self> {
        let Some(taught_network) = self.taught_network() else { return Ok(self.clone()) };
        let start = self.start.read(self.preset, &taught_network)?;
        Ok(Self { start, ..self.clone() })
    }
}
