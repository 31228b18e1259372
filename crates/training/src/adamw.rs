//! AdamW over all parameters of a module, each updated by one kernel.

use std::collections::HashMap;

use burn::module::{Module, ModuleMapper, Param, ParamId};
use burn::optim::GradientsParams;
use burn::tensor::Tensor;
use sdg_kernels::{AdamWParams, adamw};

/// The optimiser and what it remembers of every parameter.
///
/// burn's own AdamW is composed of tensor operations; on two cores it took a fifth of a training step of the `edge`
/// preset, see [`sdg_kernels::adamw`].
#[derive(Debug, Clone)]
pub struct AdamW {
    weight_decay: f64,
    max_gradient_norm: f64,
    step: i32,
    /// `[2, number of values]` for each parameter.
    moments: HashMap<ParamId, Tensor<2>>,
}

impl AdamW {
    /// With β of 0.9 and 0.999 and ε of 1e-8. `weight_decay` is decoupled from the gradients; each parameter's gradient is
    /// scaled down to a norm of `max_gradient_norm` where it is larger.
    pub fn new(weight_decay: f64, max_gradient_norm: f64) -> Self {
        Self { weight_decay, max_gradient_norm, step: 0, moments: HashMap::new() }
    }

    /// The module after a step; parameters without a gradient stay as they are.
    pub fn step<M: Module>(&mut self, learning_rate: f64, module: M, gradients: GradientsParams) -> M {
        self.step += 1;
        let params = AdamWParams {
            learning_rate: learning_rate as f32,
            beta_1: 0.9,
            beta_2: 0.999,
            epsilon: 1e-8,
            weight_decay: self.weight_decay as f32,
            max_norm: Some(self.max_gradient_norm as f32),
            step: self.step,
        };
        module.map(&mut Update { moments: &mut self.moments, gradients, params })
    }
}

struct Update<'a> {
    moments: &'a mut HashMap<ParamId, Tensor<2>>,
    gradients: GradientsParams,
    params: AdamWParams,
}

impl ModuleMapper for Update<'_> {
    fn map_float<const D: usize>(&mut self, param: Param<Tensor<D>>) -> Param<Tensor<D>> {
        let (id, tensor, mapper) = param.consume();
        let tensor = match self.gradients.remove::<D>(id) {
            None => tensor,
            Some(gradient) => {
                let tracked = tensor.is_require_grad();
                let (updated, moments) = adamw(tensor.inner(), gradient, self.moments.remove(&id), self.params);
                self.moments.insert(id, moments);
                Tensor::from_inner(updated).set_require_grad(tracked)
            }
        };
        Param::from_mapped_value(id, tensor, mapper)
    }
}

#[cfg(test)]
mod tests {
    use burn::grad_clipping::GradientClippingConfig;
    use burn::optim::AdamWConfig;
    use burn::tensor::Device;
    use sdg_detection::initialization::{Distribution, Initializer};
    use sdg_detection::layers::Linear;

    use super::*;

    #[derive(Module, Debug)]
    struct Net {
        first: Linear,
        second: Linear,
    }

    impl Net {
        fn loss(&self, x: Tensor<2>) -> Tensor<1> {
            // Large, so that gradients are clipped.
            (self.second.forward(self.first.forward(x)) * 30.0).square().mean()
        }
    }

    #[test]
    fn ten_steps_are_burns_own() {
        let device = Device::flex().autodiff();
        let mut init = Initializer::new(&device, 7);
        let mut linear =
            |inside, outside| Linear::init(inside, outside, Distribution::lecun_uniform(inside), &mut init);
        let net = Net { first: linear(6, 40), second: linear(40, 3) };
        let x = Tensor::<2>::from_floats([[1.0, 0.5, -0.3, 0.2, 0.9, -1.0], [0.1, 0.0, 2.0, -0.7, 0.4, 0.6]], &device);
        let mut theirs = AdamWConfig::new()
            .with_weight_decay(0.1)
            .with_epsilon(1e-8)
            .with_grad_clipping(Some(GradientClippingConfig::Norm(0.5)))
            .init();
        let mut ours = AdamW::new(0.1, 0.5);
        let (mut net_a, mut net_b) = (net.clone(), net);
        for step in 0..10 {
            let rate = 0.01 / f64::from(step + 1);
            let gradients = GradientsParams::from_grads(net_a.loss(x.clone()).backward(), &net_a);
            net_a = theirs.step(rate, net_a, gradients);
            let gradients = GradientsParams::from_grads(net_b.loss(x.clone()).backward(), &net_b);
            net_b = ours.step(rate, net_b, gradients);
        }
        for (a, b) in [(&net_a.first, &net_b.first), (&net_a.second, &net_b.second)] {
            let weights: f32 = (a.weight.val() - b.weight.val()).abs().max().into_scalar();
            let biases: f32 = (a.bias.val() - b.bias.val()).abs().max().into_scalar();
            assert!(weights < 1e-5 && biases < 1e-5, "{weights} {biases}");
            assert!(b.weight.val().is_require_grad());
        }
    }
}
