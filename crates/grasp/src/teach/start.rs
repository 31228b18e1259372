//! What teaching starts from.

use super::{Preset, TeachOptions};
use crate::base_weights::BaseWeights;
use crate::error::{GraspError, Result};

/// What the networks start from.
#[derive(Debug, Clone, Default)]
pub enum Start {
    /// The base weights that this build carries (feature `base-weights`); from nothing for preset `paper`, as the paper's
    /// orientation CNN does and its detectors cannot.
    #[default]
    Shipped,
    /// From random values.
    Nothing,
    /// Other weights, for the detector that [`TeachOptions::network`] or [`TeachOptions::taught_network`] gives.
    Weights(BaseWeights),
}

impl Start {
    /// The weights; none where they are not read yet or there are none.
    pub(super) fn weights(&self) -> Option<&BaseWeights> {
        match self {
            Self::Weights(weights) => Some(weights),
            Self::Shipped | Self::Nothing => None,
        }
    }
}

impl TeachOptions {
    /// The same with the shipped weights read, where these options ask for them.
    ///
    /// # Errors
    /// [`GraspError::NeedsBaseWeights`] where the preset starts from weights and this build carries none.
    pub(super) fn with_start(&self) -> Result<Self> {
        let start = match (&self.start, self.preset) {
            (Start::Shipped, Preset::Edge) => Start::Weights(self.shipped_weights()?),
            (Start::Shipped | Start::Nothing, preset) if preset.needs_base_weights() => {
                return Err(GraspError::NeedsBaseWeights { preset: preset.name() });
            }
            (Start::Shipped, _) => Start::Nothing,
            (start, _) => start.clone(),
        };
        Ok(Self { start, ..self.clone() })
    }

    /// The shipped weights for what these options teach.
    #[cfg(feature = "base-weights")]
    fn shipped_weights(&self) -> Result<BaseWeights> {
        use crate::base_weights_file::{BaseWeightsFile, SHIPPED, SHIPPED_SHA256};
        let needs = GraspError::NeedsBaseWeights { preset: self.preset.name() };
        let network = self.taught_network().ok_or(needs)?;
        BaseWeightsFile::from_bytes(SHIPPED)?.for_network(self.preset.name(), &network, SHIPPED_SHA256.to_owned())
    }

    #[cfg(not(feature = "base-weights"))]
    fn shipped_weights(&self) -> Result<BaseWeights> {
        Err(GraspError::NeedsBaseWeights { preset: self.preset.name() })
    }
}
