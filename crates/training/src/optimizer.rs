//! The configured optimiser.

use burn::grad_clipping::GradientClippingConfig;
use burn::module::Module;
use burn::optim::decay::WeightDecayConfig;
use burn::optim::momentum::MomentumConfig;
use burn::optim::{AdamWConfig, GradientsParams, ModuleOptimizer, SgdConfig};
use serde::{Deserialize, Serialize};

use crate::adamw::AdamW;

/// The update rule of a step.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Optimizer {
    /// AdamW: steps of nearly constant length for steady gradients; it learns from random values in a few hundred
    /// steps.
    AdamW,
    /// Stochastic gradient descent with momentum, as Detectron2 fine-tunes.
    Sgd {
        /// Fraction of the last step that is added to the next.
        momentum: f64,
    },
}

/// An optimiser with its state.
pub(crate) enum Stepper {
    /// Our AdamW, one kernel per parameter.
    Fused(AdamW),
    /// An optimiser of burn.
    Composed(ModuleOptimizer),
}

impl Stepper {
    /// The optimiser of a detector. Each parameter's gradient is scaled down to a norm of at most `max_gradient_norm`.
    pub(crate) fn new(optimizer: Optimizer, weight_decay: f64, max_gradient_norm: f32) -> Self {
        match optimizer {
            Optimizer::AdamW => Self::Fused(AdamW::new(weight_decay, max_gradient_norm.into())),
            Optimizer::Sgd { momentum } => {
                let sgd = SgdConfig::new()
                    // Without dampening, as in torch and Detectron2.
                    .with_momentum(Some(MomentumConfig::new().with_momentum(momentum).with_dampening(0.0)))
                    .with_weight_decay(Some(WeightDecayConfig::new(weight_decay as f32)))
                    .with_gradient_clipping(Some(GradientClippingConfig::Norm(max_gradient_norm)));
                Self::Composed(sgd.init())
            }
        }
    }

    /// burn's AdamW, which trains the orientation CNN: our AdamW differs from it in the last bits, and the models of a
    /// seed must not change.
    pub(crate) fn composed_adamw(weight_decay: f64, max_gradient_norm: f32) -> Self {
        let adamw = AdamWConfig::new()
            .with_weight_decay(weight_decay as f32)
            .with_epsilon(1e-8)
            .with_grad_clipping(Some(GradientClippingConfig::Norm(max_gradient_norm)));
        Self::Composed(adamw.init())
    }

    /// The network after a step.
    pub(crate) fn step<M: Module>(&mut self, learning_rate: f64, network: M, gradients: GradientsParams) -> M {
        match self {
            Self::Fused(adamw) => adamw.step(learning_rate, network, gradients),
            Self::Composed(optimizer) => optimizer.step(learning_rate, network, gradients),
        }
    }
}
