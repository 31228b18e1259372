//! The optimiser that a configuration asks for.

use burn::grad_clipping::GradientClippingConfig;
use burn::module::Module;
use burn::optim::decay::WeightDecayConfig;
use burn::optim::momentum::MomentumConfig;
use burn::optim::{AdamWConfig, GradientsParams, ModuleOptimizer, SgdConfig};
use serde::{Deserialize, Serialize};

use crate::adamw::AdamW;

/// What a step makes of the gradients.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Optimizer {
    /// Steps as long as the gradients are steady: learns from nothing in a few hundred of them.
    AdamW,
    /// Stochastic gradient descent with momentum, as Detectron2 fine-tunes.
    Sgd {
        /// Share of the last step that the next one keeps.
        momentum: f64,
    },
}

/// An optimiser with its state.
pub(crate) enum Stepper {
    /// Our AdamW, one kernel a parameter.
    Fused(AdamW),
    /// An optimiser of burn.
    Composed(ModuleOptimizer),
}

impl Stepper {
    /// The optimiser of a detector. Each parameter's gradient is cut to a norm of `max_gradient_norm`.
    pub(crate) fn new(optimizer: Optimizer, weight_decay: f64, max_gradient_norm: f32) -> Self {
        match optimizer {
            Optimizer::AdamW => Self::Fused(AdamW::new(weight_decay, max_gradient_norm.into())),
            Optimizer::Sgd { momentum } => {
                let sgd = SgdConfig::new()
                    // Without dampening, as torch and Detectron2 have it.
                    .with_momentum(Some(MomentumConfig::new().with_momentum(momentum).with_dampening(0.0)))
                    .with_weight_decay(Some(WeightDecayConfig::new(weight_decay as f32)))
                    .with_gradient_clipping(Some(GradientClippingConfig::Norm(max_gradient_norm)));
                Self::Composed(sgd.init())
            }
        }
    }

    /// burn's AdamW, which the orientation CNN is taught with: ours differs from it in the last bits, and the models of a
    /// seed are to stay what they are.
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
