//! The presets: networks, trainings and augmentations by name.

use std::str::FromStr;

use sdg_demonstration::AugmentationConfig;
use sdg_detection::presets;
use sdg_geometry::RotationalSymmetry;
use sdg_orientation::OrientationConfig;
use sdg_training::TrainingConfig;
use sdg_training::orientation::OrientationTraining;

use super::detector_teaching::DetectorTeaching;
use super::{paper, r50};
use crate::error::{GraspError, Result};
use crate::facts::ModelKind;
use crate::{NUM_KEYPOINTS, models};

/// Maximum order of symmetry for an orientation CNN: the remaining 5° are negligible. Derived from that.
const MAX_FOLD: usize = 72;

/// A network, its training and its augmentation under one name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Preset {
    /// For two cores.
    #[default]
    Edge,
    /// Detectron2's R50-FPN, fine-tuned from imported weights.
    R50Detectron2,
    /// torchvision's R50-FPN, fine-tuned from imported weights.
    R50Torchvision,
    /// The paper's protocol: hours on two cores.
    Paper,
}

impl Preset {
    /// Every preset of this version.
    pub const ALL: [Self; 4] = [Self::Edge, Self::R50Detectron2, Self::R50Torchvision, Self::Paper];

    /// The name on the command line and in the file.
    pub fn name(self) -> &'static str {
        match self {
            Self::Edge => "edge",
            Self::R50Detectron2 => "r50-detectron2",
            Self::R50Torchvision => "r50-torchvision",
            Self::Paper => "paper",
        }
    }

    /// Checks that networks can be taught with the weights in this build, without reading these weights.
    ///
    /// # Errors
    /// [`GraspError::NeedsBaseWeights`] if the preset starts from weights and this build contains none for it.
    pub fn check_shipped_start(self) -> Result<()> {
        if self.needs_base_weights() || (self == Self::Edge && !cfg!(feature = "base-weights")) {
            return Err(GraspError::NeedsBaseWeights { preset: self.name() });
        }
        Ok(())
    }

    /// Whether the preset's frozen stages require imported weights.
    pub(super) fn needs_base_weights(self) -> bool {
        match self {
            Self::Edge | Self::Paper => false,
            Self::R50Detectron2 | Self::R50Torchvision => true,
        }
    }

    /// The detector of a model, taught from given weights or from random values; `None` for model S, which has none.
    pub(super) fn detector(self, kind: ModelKind, has_base_weights: bool) -> Option<DetectorTeaching> {
        let rcnn = models::rcnn_kind(kind)?;
        let network = match self {
            Self::Edge => presets::edge_of(rcnn),
            Self::R50Detectron2 => r50::on_two_cores(presets::r50_detectron2(rcnn)),
            Self::R50Torchvision => r50::on_two_cores(presets::r50_torchvision(rcnn)),
            Self::Paper => paper::network(rcnn, has_base_weights),
        };
        let teaches_keypoints = self == Self::Edge && !kind.has_keypoints();
        let keypoints = || presets::edge(NUM_KEYPOINTS).roi_heads.keypoint_head;
        Some(DetectorTeaching { network, auxiliary_keypoints: teaches_keypoints.then(keypoints).flatten() })
    }

    pub(super) fn training(self, kind: ModelKind, seed: u64) -> TrainingConfig {
        match self {
            Self::Edge => TrainingConfig::edge(seed),
            Self::R50Detectron2 | Self::R50Torchvision => r50::fine_tuning(seed),
            Self::Paper => paper::training(kind, seed),
        }
    }

    /// The training samples of a first photo of this width and height. Except for `paper`, they have the network's
    /// input size, so that no computation is wasted.
    pub(super) fn samples(self, photo: [u32; 2]) -> AugmentationConfig {
        match self {
            Self::Edge => AugmentationConfig::default().with_output_size(320, 240),
            Self::R50Detectron2 | Self::R50Torchvision => {
                let [width, height] = r50::sample_size(photo);
                AugmentationConfig::default().with_output_size(width, height)
            }
            Self::Paper => paper::samples(photo),
        }
    }

    pub(super) fn orientation(self, symmetry: RotationalSymmetry, seed: u64) -> OrientationTeaching {
        let (network, mut training) = match self {
            Self::Edge | Self::R50Detectron2 | Self::R50Torchvision => {
                (OrientationConfig::edge(), OrientationTraining::edge(seed))
            }
            Self::Paper => (OrientationConfig::paper(), OrientationTraining::paper(seed)),
        };
        let fold = match symmetry {
            RotationalSymmetry::Fold(count) => (count as usize).min(MAX_FOLD),
            RotationalSymmetry::Full => {
                // Every answer is correct: there is nothing to learn.
                training.steps = 1;
                MAX_FOLD
            }
            _ => 1,
        };
        OrientationTeaching { network: network.with_symmetry(fold), training }
    }
}

impl FromStr for Preset {
    type Err = GraspError;

    fn from_str(text: &str) -> Result<Self> {
        Self::ALL.into_iter().find(|preset| preset.name() == text).ok_or_else(|| GraspError::UnknownPreset {
            known: Self::ALL.map(Self::name).to_vec(),
            found: text.to_owned(),
        })
    }
}

/// The orientation CNN and its training.
#[derive(Debug, Clone)]
pub(crate) struct OrientationTeaching {
    pub(crate) network: OrientationConfig,
    pub(crate) training: OrientationTraining,
}
