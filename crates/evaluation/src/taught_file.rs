//! A taught model that is serialised and read again. The model from the file, whose weights are rounded, is tested and
//! used instead of the network in memory.

use std::ops::ControlFlow;

use anyhow::Result;
use sdg_demonstration::Demonstration;
use sdg_grasp::{GraspError, GraspModel, Taught, TeachOptions, TeachingEvent, teach};

use crate::held_back::HeldBackFigures;

/// The result of a teaching run.
pub struct TaughtFile {
    /// The model in memory and its history.
    pub taught: Taught,
    /// The contents of the model file.
    pub bytes: Vec<u8>,
    /// The model that was read from these bytes.
    pub model: GraspModel,
}

impl TaughtFile {
    /// Teaches a model; `observe` may end teaching early.
    ///
    /// # Errors
    /// The errors of [`teach`], of [`GraspModel::to_bytes`] and of [`GraspModel::from_bytes`].
    pub fn teach(
        demonstrations: &[Demonstration],
        options: &TeachOptions,
        observe: &mut dyn FnMut(&TeachingEvent) -> ControlFlow<()>,
    ) -> Result<Self, GraspError> {
        let taught = teach(demonstrations, options, observe)?;
        let bytes = taught.model.to_bytes()?;
        let model = GraspModel::from_bytes(&bytes, &options.device)?;
        Ok(Self { taught, bytes, model })
    }

    /// Tests the model on held-out samples of its photos.
    ///
    /// # Errors
    /// Samples cannot be made, or detection fails.
    pub fn figures(&self, demonstrations: &[Demonstration], seed: u64) -> Result<HeldBackFigures> {
        HeldBackFigures::of(&self.model, demonstrations, seed)
    }
}
