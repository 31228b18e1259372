//! A convolution with group norm and ReLU, and sequences of them: the blocks of the small networks.
//!
//! [`Conv2d`](crate::Conv2d) is the general convolution, with any norm and an optional residual.

use burn::module::{Module, Param};
use burn::tensor::Tensor;
use sdg_kernels::{Activation, Conv2dParams, GroupNormParams, conv2d, group_norm};

use crate::conv::GROUP_NORM_EPS;
use crate::initialization::{Distribution, Initializer};

/// A group norm's parameters.
#[derive(Module, Debug)]
pub struct GroupNorm {
    /// Factor, `[C]`.
    pub weight: Param<Tensor<1>>,
    /// Summand, `[C]`.
    pub bias: Param<Tensor<1>>,
}

/// A convolution without a bias, its group norm, and a ReLU.
#[derive(Module, Debug)]
pub struct ConvNormRelu {
    /// Kernel, `[C_out, C_in, k, k]`.
    pub weight: Param<Tensor<4>>,
    /// Norm of the output.
    pub norm: GroupNorm,
    stride: usize,
    num_groups: usize,
}

impl ConvNormRelu {
    /// Initialises the parameters of `shape`, `[C_out, C_in, k, k]`, at random.
    pub fn init(shape: [usize; 4], stride: usize, num_groups: usize, init: &mut Initializer) -> Self {
        let [channels, in_channels, kernel, _] = shape;
        let norm = GroupNorm {
            weight: init.param([channels], Distribution::Constant(1.0)),
            bias: init.param([channels], Distribution::Constant(0.0)),
        };
        let weight = init.param(shape, Distribution::he_normal(in_channels * kernel * kernel));
        Self { weight, norm, stride, num_groups }
    }

    /// Convolves, normalises and rectifies: `[N, C_in, H, W]` to `[N, C_out, H / stride, W / stride]`.
    pub fn forward(&self, x: Tensor<4>) -> Tensor<4> {
        let weight = self.weight.val();
        let padding = weight.dims()[2] / 2;
        let convolved = conv2d(x, weight, None, Conv2dParams::square(self.stride, padding));
        let params =
            GroupNormParams { num_groups: self.num_groups, epsilon: GROUP_NORM_EPS, activation: Activation::Relu };
        group_norm(convolved, self.norm.weight.val(), self.norm.bias.val(), params)
    }
}

/// Convolutions at one size of map; the first one halves the size.
#[derive(Module, Debug)]
pub struct Stage {
    /// The convolutions, in order.
    pub convs: Vec<ConvNormRelu>,
}
