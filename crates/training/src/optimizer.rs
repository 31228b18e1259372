//! The configured optimiser.

use burn::grad_clipping::GradientClippingConfig;
use burn::module::{Module, ModuleVisitor, Param};
use burn::optim::decay::WeightDecayConfig;
use burn::optim::momentum::MomentumConfig;
use burn::optim::{AdamWConfig, GradientsParams, ModuleOptimizer, SgdConfig};
use burn::tensor::Tensor;
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
    /// burn's stochastic gradient descent, with our clipping.
    Sgd { sgd: ModuleOptimizer, max_gradient_norm: f32 },
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
                    .with_weight_decay(Some(WeightDecayConfig::new(weight_decay as f32)));
                Self::Sgd { sgd: sgd.init(), max_gradient_norm }
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
            Self::Sgd { sgd, max_gradient_norm } => {
                let mut clipping = Clipping { gradients, max_norm: *max_gradient_norm };
                network.visit(&mut clipping);
                sgd.step(learning_rate, network, clipping.gradients)
            }
            Self::Composed(optimizer) => optimizer.step(learning_rate, network, gradients),
        }
    }
}

/// Scales each parameter's gradient down to a maximum norm.
struct Clipping {
    gradients: GradientsParams,
    max_norm: f32,
}

impl ModuleVisitor for Clipping {
    fn visit_float<const D: usize>(&mut self, param: &Param<Tensor<D>>) {
        if let Some(gradient) = self.gradients.remove::<D>(param.id) {
            self.gradients.register(param.id, clipped(gradient, self.max_norm));
        }
    }
}

/// The gradient, scaled down to the norm `max_norm` if its norm is larger. Smaller gradients than burn-flex adds in
/// parallel have the same bits as with burn's clipping.
fn clipped<const D: usize>(gradient: Tensor<D>, max_norm: f32) -> Tensor<D> {
    // burn-flex adds as many values in parallel, in an order that depends on the threads.
    const NUM_PARALLEL: usize = 4 * 1024 * 1024;
    let count: usize = gradient.dims().iter().product();
    let squares = gradient.clone().square();
    let sum = if count < NUM_PARALLEL {
        squares.sum()
    } else {
        let squares: Tensor<1> = squares.reshape([count]);
        let sums = squares.split(NUM_PARALLEL - 1, 0).into_iter().map(|piece| piece.sum()).collect();
        Tensor::<1>::cat(sums, 0).sum()
    };
    let factor = (max_norm / sum.sqrt().add_scalar(f32::MIN_POSITIVE)).clamp_max(1.0);
    gradient.mul(factor.unsqueeze())
}

#[cfg(test)]
mod tests {
    use burn::tensor::{Device, Distribution, TensorData};

    use super::*;

    #[derive(Module, Debug)]
    struct Net {
        weight: Param<Tensor<2>>,
    }

    #[test]
    fn a_clipped_step_has_the_same_bits_on_any_number_of_threads() {
        // One chunk of burn-flex's parallel sum is so large that it rounds each of the others away, but not their sum.
        let gradient: Vec<f32> = (0..5_000_000).map(|k| if k < 64 * 1024 { 1.0 } else { 1.9e-4 }).collect();
        let weights = [1, 2, 7].map(|num_threads| {
            let step = || -> Vec<f32> {
                let (device, shape) = (Device::flex(), [5_000, 1_000]);
                let net = Net { weight: Param::from_tensor(Tensor::zeros(shape, &Device::flex().autodiff())) };
                let mut gradients = GradientsParams::new();
                let data = TensorData::new(gradient.clone(), shape);
                gradients.register(net.weight.id, Tensor::<2>::from_data(data, &device));
                let mut stepper = Stepper::new(Optimizer::Sgd { momentum: 0.9 }, 0.0, 10.0);
                stepper.step(1.0, net, gradients).weight.val().into_data().iter::<f32>().collect()
            };
            rayon::ThreadPoolBuilder::new().num_threads(num_threads).build().unwrap().install(step)
        });
        let norm = weights[0].iter().map(|&weight| f64::from(weight).powi(2)).sum::<f64>().sqrt();
        assert!((norm - 10.0).abs() < 1e-4, "{norm}");
        assert!(weights[1] == weights[0] && weights[2] == weights[0]);
    }

    #[test]
    fn a_gradient_is_clipped_as_by_burn() {
        let gradient = Tensor::<3>::random([7, 30, 11], Distribution::Normal(0.0, 1.0), &Device::flex());
        for max_norm in [0.5, 1e6] {
            let theirs = GradientClippingConfig::Norm(max_norm).init().clip_gradient(gradient.clone());
            assert_eq!(clipped(gradient.clone(), max_norm).into_data(), theirs.into_data());
        }
    }
}
