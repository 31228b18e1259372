//! The fully connected layer.

use burn::module::{Module, Param};
use burn::tensor::Tensor;
use sdg_kernels::Activation;

use crate::initialization::{Distribution, Initializer};

/// A fully connected layer.
#[derive(Module, Debug)]
pub struct Linear {
    /// Weight, `[out, in]`.
    pub weight: Param<Tensor<2>>,
    /// Bias, `[out]`.
    pub bias: Param<Tensor<1>>,
}

impl Linear {
    /// Initialises the weight at random; the bias is zero.
    pub fn init(in_features: usize, out_features: usize, distribution: Distribution, init: &mut Initializer) -> Self {
        Self {
            weight: init.param([out_features, in_features], distribution),
            bias: init.param([out_features], Distribution::Constant(0.0)),
        }
    }

    /// Multiplies by the weight and adds the bias.
    ///
    /// # Shapes
    /// - `x`: `[N, in]`
    /// - output: `[N, out]`
    pub fn forward(&self, x: Tensor<2>) -> Tensor<2> {
        x.matmul(self.weight.val().transpose()) + self.bias.val().unsqueeze()
    }

    /// [`Self::forward`] of flattened maps, and an activation.
    ///
    /// # Shapes
    /// - `x`: `[N, C, H, W]` with `C·H·W = in`
    /// - output: `[N, out]`
    pub fn forward_maps(&self, x: Tensor<4>, activation: Activation) -> Tensor<2> {
        sdg_kernels::fully_connected(x, self.weight.val(), self.bias.val(), activation)
    }
}
