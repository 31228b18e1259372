//! How a part is taught from base weights of our own: what differs from teaching from nothing.

use sdg_demonstration::AugmentationStyle;
use sdg_detection::config::Freeze;
use sdg_training::TrainingConfig;
use serde::{Deserialize, Serialize};

use super::Plan;

/// What differs from the preset's teaching.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FineTuning {
    /// Steps, learning rate, windows, early stop.
    pub training: TrainingConfig,
    /// What of the first stage stays as it is.
    pub freeze: Freeze,
    /// Generated parts that lie about while the part is taught, beside it and in its place.
    pub num_other_parts: usize,
    /// Share of the samples that show the part.
    pub positive_share: f32,
    /// Share of the box head's negatives that are the proposals of the highest objectness.
    pub hard_negative_share: f64,
}

impl FineTuning {
    /// The preset's own teaching, among two dozen other parts.
    pub fn new(seed: u64) -> Self {
        Self {
            training: TrainingConfig::edge(seed),
            freeze: Freeze::Nothing,
            num_other_parts: 24,
            positive_share: 0.75,
            hard_negative_share: 0.0,
        }
    }

    /// The preset's plan, changed.
    pub(super) fn adapt(&self, mut plan: Plan) -> Plan {
        plan.training = self.training.clone();
        plan.network.backbone.freeze = self.freeze;
        plan.network.roi_heads.hard_negative_share = self.hard_negative_share;
        plan.num_other_parts = self.num_other_parts;
        if let AugmentationStyle::Scenes(style) = &mut plan.samples.style {
            style.positive_share = self.positive_share;
        }
        plan
    }
}
