//! Initial values of the parameters, from a seed.
//!
//! Values are sampled on the host, one parameter after the other in the order of construction, so a seed gives
//! the same bits on any device with any number of threads.

use burn::module::{Param, ParamId};
use burn::tensor::{Device, Tensor, TensorData};
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

/// Initialises the parameters of one model.
#[derive(Debug)]
pub struct Initializer {
    /// `None` for zeros instead of random values.
    rng: Option<Pcg64Mcg>,
    device: Device,
}

/// A distribution of initial values.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Distribution {
    /// Every value is the same.
    Constant(f64),
    /// Normal around zero.
    Normal {
        /// Standard deviation.
        std: f64,
    },
    /// Uniform between `-bound` and `bound`.
    Uniform {
        /// Maximum magnitude.
        bound: f64,
    },
}

impl Distribution {
    /// He's normal distribution for layers before a ReLU: standard deviation `√(2 / fan)`.
    pub fn he_normal(fan: usize) -> Self {
        Self::Normal { std: (2.0 / fan as f64).sqrt() }
    }

    /// Uniform of variance `1 / fan`: bound `√(3 / fan)`, for linear layers.
    pub fn lecun_uniform(fan: usize) -> Self {
        Self::Uniform { bound: (3.0 / fan as f64).sqrt() }
    }
}

impl Initializer {
    /// An initialiser for parameters on `device`.
    pub fn new(device: &Device, seed: u64) -> Self {
        Self { rng: Some(Pcg64Mcg::seed_from_u64(seed)), device: device.clone() }
    }

    /// An initialiser for a network whose parameters are all replaced afterwards: sampling millions of unused
    /// numbers took a third of the time to open a grasp model. A parameter takes no memory before its first use, so a
    /// forged description of an enormous network can be refused.
    pub fn blank(device: &Device) -> Self {
        Self { rng: None, device: device.clone() }
    }

    /// Samples a trainable parameter.
    pub fn param<const D: usize>(&mut self, dims: [usize; D], distribution: Distribution) -> Param<Tensor<D>> {
        let Some(rng) = &mut self.rng else {
            let value = if let Distribution::Constant(value) = distribution { value as f32 } else { 0.0 };
            let init = move |device: &Device, trains| Tensor::full(dims, value, device).set_require_grad(trains);
            return Param::uninitialized(ParamId::new(), init, self.device.clone(), true, dims.into());
        };
        let values = values(rng, dims.iter().product(), distribution);
        Param::from_data(TensorData::new(values, dims), &self.device)
    }

    /// Makes a constant parameter that is never trained.
    pub fn frozen<const D: usize>(&mut self, dims: [usize; D], value: f64) -> Param<Tensor<D>> {
        self.param(dims, Distribution::Constant(value)).set_require_grad(false)
    }
}

fn values(rng: &mut Pcg64Mcg, count: usize, distribution: Distribution) -> Vec<f32> {
    match distribution {
        Distribution::Constant(value) => vec![value as f32; count],
        Distribution::Normal { std } => (0..count).map(|_| (std * standard_normal(rng)) as f32).collect(),
        Distribution::Uniform { bound } => {
            (0..count).map(|_| (bound * (2.0 * rng.random::<f64>() - 1.0)) as f32).collect()
        }
    }
}

/// A normally distributed number by Box and Muller's transform.
fn standard_normal(rng: &mut Pcg64Mcg) -> f64 {
    // 1 - u is in (0, 1], where the logarithm is finite.
    let radius = (-2.0 * (1.0 - rng.random::<f64>()).ln()).sqrt();
    radius * (std::f64::consts::TAU * rng.random::<f64>()).cos()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn drawn(init: &mut Initializer, count: usize, distribution: Distribution) -> Vec<f32> {
        init.param([count], distribution).val().into_data().try_to_vec().unwrap()
    }

    #[test]
    fn moments_and_bounds() {
        let mut init = Initializer::new(&Device::flex(), 1);
        let normal = drawn(&mut init, 20_000, Distribution::he_normal(8));
        let mean = normal.iter().sum::<f32>() / 20_000.0;
        let variance = normal.iter().map(|v| v * v).sum::<f32>() / 20_000.0;
        assert!(mean.abs() < 0.02 && (variance - 0.25).abs() < 0.02, "{mean} {variance}");
        let uniform = drawn(&mut init, 20_000, Distribution::lecun_uniform(12));
        assert!(uniform.iter().all(|v| v.abs() <= 0.5));
        assert!(uniform.iter().any(|v| v.abs() > 0.49));
    }

    #[test]
    fn blank_parameters_are_zeros_but_for_constants() {
        let mut init = Initializer::blank(&Device::flex());
        assert_eq!(drawn(&mut init, 3, Distribution::he_normal(8)), [0.0; 3]);
        assert_eq!(drawn(&mut init, 3, Distribution::Constant(1.5)), [1.5; 3]);
    }

    #[test]
    fn a_blank_parameter_takes_no_memory_before_its_first_use() {
        let enormous = Initializer::blank(&Device::flex()).param([1 << 30, 1 << 30], Distribution::he_normal(8));
        assert_eq!(enormous.lazy_shape().to_vec(), [1 << 30, 1 << 30]);
        assert!(!enormous.is_initialized());
    }

    #[test]
    fn the_seed_decides() {
        let draw = |seed| drawn(&mut Initializer::new(&Device::flex(), seed), 9, Distribution::he_normal(2));
        assert_eq!(draw(5), draw(5));
        assert_ne!(draw(5), draw(6));
    }
}
