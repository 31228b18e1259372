//! AdamW over all parameters of a module, each updated by one kernel.

use std::collections::HashMap;

use burn::module::{Module, ModuleMapper, ModuleVisitor, Param, ParamId};
use burn::optim::GradientsParams;
use burn::tensor::{Device, Tensor, TensorData};
use sdg_kernels::{AdamWParams, adamw};
use sdg_layers::state_dict::{StateDict, WeightTensor};

/// The optimiser and its state for every parameter.
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
    /// With β of 0.9 and 0.999 and ε of 1e-8. `weight_decay` is decoupled from the gradients; each parameter's gradient
    /// is scaled down to a norm of `max_gradient_norm` if its norm is larger.
    pub fn new(weight_decay: f64, max_gradient_norm: f64) -> Self {
        Self { weight_decay, max_gradient_norm, step: 0, moments: HashMap::new() }
    }

    /// The module after a step; parameters without a gradient are unchanged.
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

/// The state of [`AdamW`] between steps, by the parameters' names: enough to continue with the same bits.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct AdamWState {
    /// Steps done.
    pub step: i32,
    /// `[2, number of values]` for each parameter that had a gradient: the running means of the gradient and of its
    /// square.
    pub moments: StateDict,
}

impl AdamW {
    /// The state of the optimiser of `module`.
    pub fn state<M: Module>(&self, module: &M) -> AdamWState {
        let mut moments = StateDict::new();
        for (name, id, ..) in named_parameters(module) {
            if let Some(tensor) = self.moments.get(&id) {
                let shape = tensor.dims().to_vec();
                let values = tensor.clone().into_data().iter::<f32>().collect();
                moments.insert(name, WeightTensor { shape, values });
            }
        }
        AdamWState { step: self.step, moments }
    }

    /// The optimiser of `module` with a state from [`Self::state`]. Moments of parameters that the module lacks, or has
    /// in a different size, are left out.
    pub fn with_state<M: Module>(mut self, module: &M, state: &AdamWState) -> Self {
        self.step = state.step;
        self.moments.clear();
        for (name, id, count, device) in named_parameters(module) {
            if let Some(saved) = state.moments.get(&name).filter(|saved| saved.shape == [2, count]) {
                let data = TensorData::new(saved.values.clone(), [2, count]);
                self.moments.insert(id, Tensor::from_data(data, &device));
            }
        }
        self
    }
}

/// Name, id, number of values and device (without autodiff) of every float parameter.
fn named_parameters<M: Module>(module: &M) -> Vec<(String, ParamId, usize, Device)> {
    struct Names {
        path: Vec<String>,
        found: Vec<(String, ParamId, usize, Device)>,
    }
    impl ModuleVisitor for Names {
        fn enter_module(&mut self, name: &str, _container_type: &str) {
            self.path.push(name.to_owned());
        }
        fn exit_module(&mut self, _name: &str, _container_type: &str) {
            self.path.pop();
        }
        fn visit_float<const D: usize>(&mut self, param: &Param<Tensor<D>>) {
            let tensor = param.val().inner();
            let count = tensor.dims().iter().product();
            self.found.push((self.path.join("."), param.id, count, tensor.device()));
        }
    }
    let mut names = Names { path: Vec::new(), found: Vec::new() };
    module.visit(&mut names);
    names.found
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
    use sdg_layers::Linear;
    use sdg_layers::initialization::{Distribution, Initializer};
    use sdg_layers::state_dict;

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
    fn a_restored_optimiser_goes_on_with_the_same_bits() {
        let device = Device::flex().autodiff();
        let mut init = Initializer::new(&device, 3);
        let mut linear =
            |inside, outside| Linear::init(inside, outside, Distribution::lecun_uniform(inside), &mut init);
        let mut net = Net { first: linear(3, 5), second: linear(5, 2) };
        let x = Tensor::<2>::from_floats([[1.0, 0.5, -0.3]], &device);
        let step = |adamw: &mut AdamW, net: Net| {
            let gradients = GradientsParams::from_grads(net.loss(x.clone()).backward(), &net);
            adamw.step(0.01, net, gradients)
        };
        let mut adamw = AdamW::new(0.1, 0.5);
        for _ in 0..3 {
            net = step(&mut adamw, net);
        }
        let state = adamw.state(&net);
        assert_eq!((state.step, state.moments.len()), (3, 4));
        let mut restored = AdamW::new(0.1, 0.5).with_state(&net, &state);
        let (one, other) = (step(&mut adamw, net.clone()), step(&mut restored, net.clone()));
        assert_eq!(state_dict::export(&one), state_dict::export(&other));
        // A step without the state differs.
        let forgetful = step(&mut AdamW::new(0.1, 0.5), net);
        assert_ne!(state_dict::export(&one), state_dict::export(&forgetful));
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
