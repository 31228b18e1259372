//! A model taught, written and read again: the file, whose weights are rounded, is tried and used, not the network in memory.

use std::ops::ControlFlow;

use anyhow::Result;
use sdg_demonstration::Demonstration;
use sdg_grasp::{GraspError, GraspModel, Taught, TeachOptions, TeachingEvent, teach};

use crate::held_back::HeldBackFigures;

/// A teaching's result.
pub struct TaughtFile {
    /// As teaching left it, with its history.
    pub taught: Taught,
    /// The model's file.
    pub bytes: Vec<u8>,
    /// The model, read from these.
    pub model: GraspModel,
}

impl TaughtFile {
    /// Teaches; `observe` may end it early.
    ///
    /// # Errors
    /// The errors of [`teach`].
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

    /// Tries it on samples of its photos that it never saw.
    ///
    /// # Errors
    /// Samples that cannot be made, and errors of detection.
    pub fn figures(&self, demonstrations: &[Demonstration], seed: u64) -> Result<HeldBackFigures> {
        HeldBackFigures::of(&self.model, demonstrations, seed)
    }
}
