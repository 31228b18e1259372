//! The options of teaching.

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
use crate::plan_view::CameraOverTable;
use crate::region::SearchRegion;

/// The options of teaching.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct TeachOptions {
    /// The grasp model to teach.
    pub kind: ModelKind,
    /// The network and its training; not used by model S, which has neither.
    pub preset: Preset,
    /// The seed of every random choice.
    pub seed: u64,
    /// Maximum wall-clock time for the training.
    pub time_budget: Option<Duration>,
    /// Number of detector steps, if it differs from the preset's; the number for the orientation CNN changes in
    /// proportion. For tests and trials.
    pub steps: Option<usize>,
    /// The fine-tuning; if `None`, [`FineTuning::new`] for this project's base weights, else the preset's training.
    pub fine_tuning: Option<FineTuning>,
    /// The part's symmetry: its rotations are neither taught nor counted as errors.
    pub symmetry: RotationalSymmetry,
    /// Range of sizes, relative to the nominal one, at which the part is searched.
    pub size_tolerance: RangeInclusive<f64>,
    /// The region of pictures that the model searches. In teaching, it restricts only the use of `negatives`.
    pub region: Option<SearchRegion>,
    /// The lengths returned by [`crate::seen_from_above`], if it made the demonstrations.
    pub lengths: Option<Lengths>,
    /// The camera of which `negatives` are plan views, made by [`crate::pictures_from_above`]. Without it, `region` has
    /// no effect on plan views.
    pub over_table: Option<CameraOverTable>,
    /// The user's pictures without the part: some of a network's samples, and data for the score's calibration. Each
    /// picture counts once, and none is used as a background of other samples.
    pub negatives: Vec<RgbImage>,
    /// The initial weights of the networks.
    pub start: Start,
    /// The computing device, without gradients.
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
            over_table: None,
            negatives: Vec::new(),
            start: Start::default(),
            device: Device::flex(),
        }
    }

    /// The taught detector, which initial weights must fit; `None` for model S, which has none.
    pub fn network(&self) -> Option<RcnnConfig> {
        self.preset.detector(self.kind, true).map(|detector| detector.network)
    }

    /// The detector during teaching, which may have more heads than the model; this project's base weights are read for
    /// it.
    pub fn taught_network(&self) -> Option<RcnnConfig> {
        self.preset.detector(self.kind, true).map(|detector| detector.taught())
    }

    /// The options with the shipped weights read, if they request these weights.
    ///
    /// # Errors
    /// [`GraspError::NeedsBaseWeights`](crate::GraspError::NeedsBaseWeights) if the preset starts from weights and
    /// this build contains none.
    pub fn with_start_read(&self) -> Result<Self> {
        let Some(taught_network) = self.taught_network() else { return Ok(self.clone()) };
        let start = self.start.read(self.preset, &taught_network)?;
        Ok(Self { start, ..self.clone() })
    }
}
