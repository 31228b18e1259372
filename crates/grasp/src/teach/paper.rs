//! The paper's protocol: its network, samples, steps, learning rates and batches.
//!
//! As published: R50-FPN at a short side of 800 pixels, SGD, 1500 samples of the paper's augmentation for 1000 steps of
//! two images (model A's detector: 500 steps of eight), 200 held-out samples, 5000 crops for the orientation CNN.
//!
//! Corrected, because these are errors of the original code and not part of the protocol:
//! - the learning rate follows one cycle; the original's warm-up of 1000 steps increases it during the whole run;
//! - the network gets the colour channels in the order of its weights;
//! - no mirror images;
//! - the angle is a least-squares line with `atan2`.
//!
//! On two cores such a run takes hours.

use sdg_demonstration::AugmentationConfig;
use sdg_detection::RcnnConfig;
use sdg_detection::config::{Freeze, NormKind};
use sdg_detection::presets::{RcnnKind, r50_detectron2};
use sdg_training::{OneCycle, Optimizer, TrainingConfig, ValidationConfig};

use super::r50;
use crate::facts::ModelKind;

/// Number of samples, which are repeated in the same order.
pub(super) const DISTINCT_SAMPLES: u64 = 1500;
/// Number of held-out samples.
const HELD_BACK: usize = 200;

/// Detectron2's R50-FPN. With imported weights, stem, res2 and norms are frozen. From random values nothing is frozen:
/// all layers learn, and the frozen norms, which would have no effect, are replaced by group norms.
pub(super) fn network(kind: RcnnKind, has_base_weights: bool) -> RcnnConfig {
    let mut config = r50_detectron2(kind);
    if !has_base_weights {
        config.backbone.norm = NormKind::Group { num_groups: 32 };
        config.backbone.freeze = Freeze::Nothing;
    }
    config
}

/// The settings of the detector's training.
///
/// # Source
/// Paper, section V; the published code's settings.
pub(super) fn training(kind: ModelKind, seed: u64) -> TrainingConfig {
    let (steps, batch_size, peak) = match kind {
        ModelKind::A => (500, 8, 0.005),
        _ => (1000, 2, 0.0008),
    };
    TrainingConfig {
        steps,
        batch_size,
        windows: None,
        optimizer: Optimizer::Sgd { momentum: 0.9 },
        schedule: OneCycle { peak, warm_up: 0.1 },
        weight_decay: 1e-4,
        validation: ValidationConfig { every: steps, first: steps, samples: HELD_BACK },
        early_stop: None,
        ..TrainingConfig::edge(seed)
    }
}

/// The training samples of a photo: 640 × 480 pixels for a photo of this shape.
pub(super) fn samples(photo: [u32; 2]) -> AugmentationConfig {
    let [width, height] = r50::sample_size(photo);
    AugmentationConfig::paper().with_output_size(width, height)
}
