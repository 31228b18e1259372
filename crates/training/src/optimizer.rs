//! The optimiser that a configuration asks for.

use burn::grad_clipping::GradientClippingConfig;
use burn::optim::decay::WeightDecayConfig;
use burn::optim::momentum::MomentumConfig;
use burn::optim::{GradientsParams, ModuleOptimizer, SgdConfig};
use sdg_detection::GeneralizedRcnn;

use crate::adamw::AdamW;
use crate::config::{Optimizer, TrainingConfig};

/// An optimiser with its state.
pub(crate) enum Stepper {
    AdamW(AdamW),
    Sgd(ModuleOptimizer),
}

impl Stepper {
    pub(crate) fn new(config: &TrainingConfig) -> Self {
        match config.optimizer {
            Optimizer::AdamW => Self::AdamW(AdamW::new(config.weight_decay, config.max_gradient_norm.into())),
            Optimizer::Sgd { momentum } => {
                let clipping = GradientClippingConfig::Norm(config.max_gradient_norm);
                let sgd = SgdConfig::new()
                    // Without dampening, as torch and Detectron2 have it.
                    .with_momentum(Some(MomentumConfig::new().with_momentum(momentum).with_dampening(0.0)))
                    .with_weight_decay(Some(WeightDecayConfig::new(config.weight_decay as f32)))
                    .with_gradient_clipping(Some(clipping));
                Self::Sgd(sgd.init())
            }
        }
    }

    /// The detector after a step.
    pub(crate) fn step(
        &mut self,
        learning_rate: f64,
        detector: GeneralizedRcnn,
        gradients: GradientsParams,
    ) -> GeneralizedRcnn {
        match self {
            Self::AdamW(adamw) => adamw.step(learning_rate, detector, gradients),
            Self::Sgd(sgd) => sgd.step(learning_rate, detector, gradients),
        }
    }
}
