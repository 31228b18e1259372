//! Teaching from this project's base weights: the differences from teaching from random values.

use sdg_detection::config::Freeze;
use sdg_training::{EarlyStop, TrainingConfig, ValidationConfig};
use serde::{Deserialize, Serialize};

/// Maximum number of steps; the training stops earlier if the network is good.
const STEPS: usize = 120;

/// The differences from the preset's teaching.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FineTuning {
    /// Steps, learning rate, windows, early stop.
    pub training: TrainingConfig,
    /// The part of the detector that stays frozen.
    pub freeze: Freeze,
    /// Number of generated parts shown during teaching, beside the part and in its place.
    pub num_other_parts: usize,
    /// Fraction of the samples that show the part.
    pub positive_share: f32,
    /// Fraction of the box head's negatives that are the proposals of the highest objectness.
    pub hard_negative_share: f64,
}

impl FineTuning {
    /// Settings with which teaching takes half a minute on two cores, with two dozen other parts. For most parts the
    /// network is good enough after 40 steps; in about six of 30 held-out samples with the part, the part is so covered
    /// or blurred that no network finds it.
    pub fn new(seed: u64) -> Self {
        Self {
            training: TrainingConfig {
                steps: STEPS,
                validation: ValidationConfig { every: 20, first: 40, samples: 40 },
                early_stop: Some(EarlyStop {
                    hit_rate: 0.8,
                    median_error_px: 3.0,
                    median_error_degrees: 2.0,
                    false_alarm_rate: 0.2,
                    cool_down: 15,
                }),
                ..TrainingConfig::edge(seed)
            },
            freeze: Freeze::Nothing,
            num_other_parts: 24,
            positive_share: 0.75,
            hard_negative_share: 0.0,
        }
    }
}
