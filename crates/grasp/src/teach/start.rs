//! The initial weights of teaching.

use sdg_detection::RcnnConfig;

use super::preset::Preset;
use crate::base_weights::BaseWeights;
use crate::error::{GraspError, Result};

/// The initial weights of the networks.
#[derive(Debug, Clone, Default)]
pub enum Start {
    /// The base weights in this build (feature `base-weights`). For preset `paper`, random values, because its
    /// detectors cannot start from these weights and the paper's orientation CNN starts from random values.
    #[default]
    Shipped,
    /// Random values.
    Nothing,
    /// Other weights, for the detector of [`TeachOptions::network`](super::TeachOptions::network) or
    /// [`TeachOptions::taught_network`](super::TeachOptions::taught_network).
    Weights(BaseWeights),
}

impl Start {
    /// The weights; `None` if they are not read yet or do not exist.
    pub(super) fn weights(&self) -> Option<&BaseWeights> {
        match self {
            Self::Weights(weights) => Some(weights),
            Self::Shipped | Self::Nothing => None,
        }
    }

    /// The start with the shipped weights read, if they are requested and the preset starts from them.
    ///
    /// # Errors
    /// [`GraspError::NeedsBaseWeights`] if the preset starts from weights and this build contains none.
    pub(super) fn read(&self, preset: Preset, taught_network: &RcnnConfig) -> Result<Self> {
        match (self, preset) {
            (Self::Shipped, Preset::Edge) => shipped_weights(preset, taught_network).map(Self::Weights),
            (Self::Shipped | Self::Nothing, preset) if preset.needs_base_weights() => {
                Err(GraspError::NeedsBaseWeights { preset: preset.name() })
            }
            (Self::Shipped, _) => Ok(Self::Nothing),
            (start, _) => Ok(start.clone()),
        }
    }
}

/// The shipped weights for a network.
#[cfg(feature = "base-weights")]
fn shipped_weights(preset: Preset, taught_network: &RcnnConfig) -> Result<BaseWeights> {
    use crate::base_weights_file::{BaseWeightsFile, SHIPPED, SHIPPED_SHA256};
    BaseWeightsFile::from_bytes(SHIPPED)?.for_network(preset.name(), taught_network, SHIPPED_SHA256.to_owned())
}

#[cfg(not(feature = "base-weights"))]
fn shipped_weights(preset: Preset, _taught_network: &RcnnConfig) -> Result<BaseWeights> {
    Err(GraspError::NeedsBaseWeights { preset: preset.name() })
}
