//! What a preset teaches a model with: network, samples, steps.

use std::str::FromStr;

use sdg_demonstration::AugmentationConfig;
use sdg_detection::presets::RcnnKind;
use sdg_detection::{RcnnConfig, presets};
use sdg_geometry::RotationalSymmetry;
use sdg_orientation::OrientationConfig;
use sdg_training::TrainingConfig;
use sdg_training::orientation::OrientationTraining;

use super::{FineTuning, TeachOptions, paper, r50};
use crate::NUM_KEYPOINTS;
use crate::base_weights::BaseWeights;
use crate::error::{GraspError, Result};
use crate::facts::ModelKind;

/// As often as an orientation CNN may fold the circle: what is left of it, 5°, is negligible. Chosen by that
/// reasoning.
const MAX_FOLD: usize = 72;

/// The `edge` network as it is taught: with a keypoint head, which models without keypoints leave out afterwards.
///
/// A box, or the mask of something thin, tells a network made from nothing too little of what the part is. After 260 steps
/// model A's found the rod end in 17 and the fuel line in 12 of 35 held-back samples; after 300 with keypoints in 20 and 14.
fn with_keypoints(mut network: RcnnConfig) -> RcnnConfig {
    network.roi_heads.keypoint_head = presets::edge(NUM_KEYPOINTS).roi_heads.keypoint_head;
    network
}

/// A network that leads the demonstration to fewer parts is of no use. Chosen by hand, not measured.
const MIN_HIT_RATE: f64 = 0.5;

/// A network, its training and its augmentation under one name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Preset {
    /// Made for two cores: minutes from photo to grasp.
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

    /// Whether its frozen stages are worth nothing without imported weights.
    pub(super) fn needs_base_weights(self) -> bool {
        match self {
            Self::Edge | Self::Paper => false,
            Self::R50Detectron2 | Self::R50Torchvision => true,
        }
    }

    /// The detector that is taught, from imported weights or from nothing.
    pub(super) fn network(self, kind: RcnnKind, has_base_weights: bool) -> RcnnConfig {
        match self {
            Self::Edge => presets::edge_of(kind),
            Self::R50Detectron2 => r50::on_two_cores(presets::r50_detectron2(kind)),
            Self::R50Torchvision => r50::on_two_cores(presets::r50_torchvision(kind)),
            Self::Paper => paper::network(kind, has_base_weights),
        }
    }

    fn training(self, kind: ModelKind, seed: u64) -> TrainingConfig {
        match self {
            Self::Edge => TrainingConfig::edge(seed),
            Self::R50Detectron2 | Self::R50Torchvision => r50::fine_tuning(seed),
            Self::Paper => paper::training(kind, seed),
        }
    }

    /// The training samples: of the network's input size, so that nothing is computed to be thrown away.
    fn samples(self) -> AugmentationConfig {
        match self {
            Self::Edge => AugmentationConfig::default().with_output_size(320, 240),
            Self::R50Detectron2 | Self::R50Torchvision => {
                AugmentationConfig::default().with_output_size(640, r50::SHORT_SIDE_PX)
            }
            Self::Paper => paper::samples(),
        }
    }

    fn orientation(self, symmetry: RotationalSymmetry, seed: u64) -> OrientationPlan {
        let (network, mut training) = match self {
            Self::Edge | Self::R50Detectron2 | Self::R50Torchvision => {
                (OrientationConfig::edge(), OrientationTraining::edge(seed))
            }
            Self::Paper => (OrientationConfig::paper(), OrientationTraining::paper(seed)),
        };
        let fold = match symmetry {
            RotationalSymmetry::Fold(count) => (count as usize).min(MAX_FOLD),
            RotationalSymmetry::Full => {
                // Every answer is right: there is nothing to learn.
                training.steps = 1;
                MAX_FOLD
            }
            _ => 1,
        };
        OrientationPlan { network: network.with_symmetry(fold), training }
    }

    /// How a model with a network is taught.
    pub(super) fn plan(self, rcnn: RcnnKind, options: &TeachOptions) -> Plan {
        let &TeachOptions { kind, seed, symmetry, .. } = options;
        let network = self.network(rcnn, options.start.weights().is_some());
        let plan = Plan {
            network: if self == Self::Edge { with_keypoints(network) } else { network },
            training: self.training(kind, seed),
            samples: self.samples(),
            distinct_samples: (self == Self::Paper).then_some(paper::DISTINCT_SAMPLES),
            held_back: match self {
                Self::Paper => AugmentationConfig::paper(),
                // At the photo's own size, so that verification is calibrated on what it will see.
                _ => AugmentationConfig::default(),
            },
            min_hit_rate: MIN_HIT_RATE,
            orientation: (kind == ModelKind::A).then(|| self.orientation(symmetry, seed)),
            num_other_parts: 0,
        };
        let starts_from_ours = options.start.weights().is_some_and(BaseWeights::is_ours);
        let usual = || starts_from_ours.then(|| FineTuning::new(seed));
        match options.fine_tuning.clone().or_else(usual) {
            Some(fine_tuning) => fine_tuning.adapt(plan),
            None => plan,
        }
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

/// Everything that decides how a network model is taught, but for the demonstrations.
#[derive(Debug, Clone)]
pub(crate) struct Plan {
    /// The detector.
    pub(crate) network: RcnnConfig,
    /// Its training.
    pub(crate) training: TrainingConfig,
    /// What it is trained on.
    pub(crate) samples: AugmentationConfig,
    /// Samples before the first comes round again; `None` for new ones for ever.
    pub(crate) distinct_samples: Option<u64>,
    /// What it is validated and calibrated on.
    pub(crate) held_back: AugmentationConfig,
    /// Least share of parts that a network must lead the demonstration to, so that it is kept.
    pub(crate) min_hit_rate: f64,
    /// Model A's other network.
    pub(crate) orientation: Option<OrientationPlan>,
    /// Generated parts that lie about while the part is taught, beside it and in its place.
    pub(crate) num_other_parts: usize,
}

/// The orientation CNN and its training.
#[derive(Debug, Clone)]
pub(crate) struct OrientationPlan {
    pub(crate) network: OrientationConfig,
    pub(crate) training: OrientationTraining,
}

impl Plan {
    /// The same with other detector steps; the orientation CNN's change in proportion.
    pub(super) fn with_steps(mut self, steps: usize) -> Self {
        if let Some(OrientationPlan { training, .. }) = &mut self.orientation {
            training.steps = (training.steps * steps).div_ceil(self.training.steps);
        }
        self.training.steps = steps;
        self.training.validation.first = self.training.validation.first.min(steps);
        self
    }
}
