//! Convolutions with the operations that follow them, and layers that double the size of a map.
//!
//! Shapes: N images or ROIs, C channels, H×W cells.

use burn::module::{Module, Param};
use burn::tensor::Tensor;
use sdg_kernels::{
    Activation, Conv2dEpilogue, Conv2dParams, GroupNormParams, conv2d, conv2d_fused, group_norm_residual,
};
use serde::{Deserialize, Serialize};

use crate::initialization::{Distribution, Initializer};

/// Normalisation after a convolution.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum NormKind {
    /// No norm: the convolution has a bias instead.
    Identity,
    /// Mean and variance over groups of channels of one image; weight and bias are trained.
    Group {
        /// Number of groups.
        num_groups: usize,
    },
    /// Stored mean and variance, never trained.
    FrozenBatch {
        /// Added to the variance; 1e-5 in Detectron2, 0 in some of torchvision's builders.
        eps: f64,
    },
}

/// Normalisation with a weight and a bias for each channel.
#[derive(Module, Debug)]
pub struct Norm {
    /// Factor, `[C]`.
    pub weight: Param<Tensor<1>>,
    /// Summand, `[C]`.
    pub bias: Param<Tensor<1>>,
    /// Stored mean, `[C]`, for frozen batch norm.
    pub running_mean: Option<Param<Tensor<1>>>,
    /// Stored variance, `[C]`, for frozen batch norm.
    pub running_var: Option<Param<Tensor<1>>>,
    #[module(skip)]
    kind: NormKind,
}

/// Added to the variance of a group.
pub(crate) const GROUP_NORM_EPS: f32 = 1e-5;

impl Norm {
    /// A norm of `channels` channels, or `None` for [`NormKind::Identity`].
    pub fn init(kind: NormKind, channels: usize, init: &mut Initializer) -> Option<Self> {
        match kind {
            NormKind::Identity => None,
            NormKind::Group { .. } => Some(Self {
                weight: init.param([channels], Distribution::Constant(1.0)),
                bias: init.param([channels], Distribution::Constant(0.0)),
                running_mean: None,
                running_var: None,
                kind,
            }),
            NormKind::FrozenBatch { .. } => Some(Self {
                weight: init.frozen([channels], 1.0),
                bias: init.frozen([channels], 0.0),
                running_mean: Some(init.frozen([channels], 0.0)),
                running_var: Some(init.frozen([channels], 1.0)),
                kind,
            }),
        }
    }

    /// The stored normalisation as `x · scale + shift`, each `[C]`; `None` for group norm.
    fn as_affine(&self) -> Option<[Tensor<1>; 2]> {
        let NormKind::FrozenBatch { eps } = self.kind else {
            return None;
        };
        let (mean, var) = (self.running_mean.as_ref()?, self.running_var.as_ref()?);
        let scale = self.weight.val() / (var.val() + eps).sqrt();
        let shift = self.bias.val() - mean.val() * scale.clone();
        Some([scale, shift])
    }
}

/// A convolution, followed by a bias or a norm.
#[derive(Module, Debug)]
pub struct Conv2d {
    /// Kernel, `[C_out, C_in, K, K]`.
    pub weight: Param<Tensor<4>>,
    /// Bias, `[C_out]`.
    pub bias: Option<Param<Tensor<1>>>,
    /// Norm of the output.
    pub norm: Option<Norm>,
    stride: usize,
    padding: usize,
}

/// Shape of a [`Conv2d`]; the padding keeps the size (at stride 1).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Conv2dShape {
    /// Channels of the input.
    pub in_channels: usize,
    /// Channels of the output.
    pub out_channels: usize,
    /// Side of the kernel, odd.
    pub kernel: usize,
    /// Step of the kernel along both axes.
    pub stride: usize,
}

impl Conv2dShape {
    /// A shape of stride 1.
    pub fn new(in_channels: usize, out_channels: usize, kernel: usize) -> Self {
        Self { in_channels, out_channels, kernel, stride: 1 }
    }

    /// The shape with a different stride.
    pub fn with_stride(self, stride: usize) -> Self {
        Self { stride, ..self }
    }

    /// Number of weights that feed one output.
    pub fn fan_in(&self) -> usize {
        self.in_channels * self.kernel * self.kernel
    }

    /// Number of weights that one input feeds.
    pub fn fan_out(&self) -> usize {
        self.out_channels * self.kernel * self.kernel
    }

    /// Draws the kernel from `distribution`; the bias is zero. A norm replaces the bias.
    pub fn init(self, distribution: Distribution, norm: NormKind, init: &mut Initializer) -> Conv2d {
        let Self { in_channels, out_channels, kernel, stride } = self;
        let weight = init.param([out_channels, in_channels, kernel, kernel], distribution);
        let norm = Norm::init(norm, out_channels, init);
        let bias = match norm {
            Some(_) => None,
            None => Some(init.param([out_channels], Distribution::Constant(0.0))),
        };
        Conv2d { weight, bias, norm, stride, padding: kernel / 2 }
    }
}

impl Conv2d {
    /// Convolves and normalises.
    ///
    /// # Shapes
    /// - `x`: `[N, C_in, H, W]`
    /// - output: `[N, C_out, ⌈H / stride⌉, ⌈W / stride⌉]`
    pub fn forward(&self, x: Tensor<4>) -> Tensor<4> {
        self.forward_then(x, None, Activation::Identity)
    }

    /// Convolves, normalises and rectifies.
    ///
    /// # Shapes
    /// As for [`Self::forward`].
    pub fn forward_relu(&self, x: Tensor<4>) -> Tensor<4> {
        self.forward_then(x, None, Activation::Relu)
    }

    /// Convolves and normalises, adds `residual` and activates; except for group norm, in one pass over the result.
    ///
    /// # Shapes
    /// As for [`Self::forward`]; `residual` has the shape of the output.
    pub fn forward_then(&self, x: Tensor<4>, residual: Option<Tensor<4>>, activation: Activation) -> Tensor<4> {
        let params = Conv2dParams::square(self.stride, self.padding);
        let weight = self.weight.val();
        let bias = self.bias.as_ref().map(|b| b.val());
        let Some(norm) = &self.norm else {
            return conv2d_fused(x, weight, bias, params, Conv2dEpilogue { scale: None, residual, activation });
        };
        match (norm.kind, norm.as_affine()) {
            (_, Some([scale, shift])) => {
                let epilogue = Conv2dEpilogue { scale: Some(scale), residual, activation };
                conv2d_fused(x, weight, Some(shift), params, epilogue)
            }
            (NormKind::Group { num_groups }, None) => {
                let x = conv2d(x, weight, None, params);
                let params = GroupNormParams { num_groups, epsilon: GROUP_NORM_EPS, activation };
                group_norm_residual(x, norm.weight.val(), norm.bias.val(), residual, params)
            }
            _ => conv2d_fused(x, weight, None, params, Conv2dEpilogue { scale: None, residual, activation }),
        }
    }
}

/// A transposed convolution with stride 2 and an even kernel, padded to double height and width.
#[derive(Module, Debug)]
pub struct ConvTranspose2x {
    /// Kernel, `[C_in, C_out, K, K]`.
    pub weight: Param<Tensor<4>>,
    /// Bias, `[C_out]`.
    pub bias: Param<Tensor<1>>,
}

impl ConvTranspose2x {
    /// Initialises the parameters at random for a kernel of 2 or 4 cells; the bias is zero.
    pub fn init(in_channels: usize, out_channels: usize, kernel: usize, init: &mut Initializer) -> Self {
        assert!(kernel == 2 || kernel == 4, "expected a kernel of 2 or 4 cells, found {kernel}");
        // PyTorch computes the `fan_out` of a transposed convolution from its first axis, the input channels.
        let distribution = Distribution::he_normal(in_channels * kernel * kernel);
        Self {
            weight: init.param([in_channels, out_channels, kernel, kernel], distribution),
            bias: init.param([out_channels], Distribution::Constant(0.0)),
        }
    }

    /// Applies the transposed convolution.
    ///
    /// # Shapes
    /// - `x`: `[N, C_in, H, W]`
    /// - output: `[N, C_out, 2H, 2W]`
    pub fn forward(&self, x: Tensor<4>) -> Tensor<4> {
        let weight = self.weight.val();
        let [_, _, kernel, _] = weight.dims();
        let params = Conv2dParams::square(2, (kernel - 2) / 2);
        sdg_kernels::conv_transpose2d(x, weight, Some(self.bias.val()), params)
    }
}

/// Doubles height and width of square maps by linear interpolation along each axis, edges
/// repeated: PyTorch's bilinear interpolation with `align_corners=False`.
///
/// # Shapes
/// - `x`: `[N, C, S, S]`
/// - output: `[N, C, 2S, 2S]`
pub fn upsample_bilinear_2x(x: Tensor<4>) -> Tensor<4> {
    let [n, c, s, width] = x.dims();
    assert_eq!(s, width, "expected square maps");
    let mut weights = vec![0f32; s * 2 * s];
    for output in 0..2 * s {
        let at = ((output as f32 + 0.5) / 2.0 - 0.5).max(0.0);
        let first = at as usize;
        let second = (first + 1).min(s - 1);
        weights[first * 2 * s + output] += 1.0 - (at - first as f32);
        weights[second * 2 * s + output] += at - first as f32;
    }
    let stretch = Tensor::<1>::from_floats(weights.as_slice(), &x.device()).reshape([s, 2 * s]);
    // Each axis is doubled by a matrix product over the last axis: first the columns, [N·C·S, S] x [S, 2S], then the
    // rows in the same way.
    let wide: Tensor<3> = x.reshape([n * c * s, s]).matmul(stretch.clone()).reshape([n * c, s, 2 * s]);
    wide.swap_dims(1, 2)
        .reshape([n * c * 2 * s, s])
        .matmul(stretch)
        .reshape([n * c, 2 * s, 2 * s])
        .swap_dims(1, 2)
        .reshape([n, c, 2 * s, 2 * s])
}

#[cfg(test)]
mod tests {
    use super::*;
    use burn::tensor::{Device, Tolerance};

    fn tensor<const D: usize>(values: &[f32], dims: [usize; D]) -> Tensor<D> {
        Tensor::<1>::from_floats(values, &Device::flex()).reshape(dims)
    }

    #[test]
    fn bilinear_upsampling_by_hand() {
        // Within a row, [0, 4] becomes [0, 1, 3, 4]; within a column, [0, 8] becomes [0, 2, 6, 8].
        let x = tensor(&[0.0, 4.0, 8.0, 12.0], [1, 1, 2, 2]);
        let expected = [0.0, 1.0, 3.0, 4.0, 2.0, 3.0, 5.0, 6.0, 6.0, 7.0, 9.0, 10.0, 8.0, 9.0, 11.0, 12.0];
        assert_eq!(upsample_bilinear_2x(x).into_data().try_to_vec_as::<f32>().unwrap(), expected);
    }

    #[test]
    fn group_norm_standardises_each_group() {
        let mut init = Initializer::new(&Device::flex(), 1);
        let kind = NormKind::Group { num_groups: 2 };
        let mut conv = Conv2dShape::new(4, 4, 1).init(Distribution::Constant(0.0), kind, &mut init);
        let identity = (0..16).map(|at| f32::from(u8::from(at % 5 == 0))).collect::<Vec<_>>();
        conv.weight = Param::from_tensor(tensor(&identity, [4, 4, 1, 1]));
        // Group 1 holds 1, 3 (mean 2, deviation 1), group 2 holds 10, 30 (mean 20, deviation 10).
        let x = tensor(&[1.0, 3.0, 10.0, 30.0], [1, 4, 1, 1]);
        let expected = tensor(&[-1.0, 1.0, -1.0, 1.0], [1, 4, 1, 1]);
        let found = conv.forward(x.clone()).into_data();
        found.assert_approx_eq::<f32>(&expected.into_data(), Tolerance::absolute(1e-4));
        // With half of the input added: -0.5, 2.5, 4, 16; the ReLU makes negative values 0.
        let expected = tensor(&[0.0, 2.5, 4.0, 16.0], [1, 4, 1, 1]);
        let found = conv.forward_then(x.clone(), Some(x / 2.0), Activation::Relu).into_data();
        found.assert_approx_eq::<f32>(&expected.into_data(), Tolerance::absolute(1e-4));
    }

    #[test]
    fn frozen_batch_norm_by_hand() {
        let mut init = Initializer::new(&Device::flex(), 1);
        let kind = NormKind::FrozenBatch { eps: 0.0 };
        let mut conv = Conv2dShape::new(1, 1, 1).init(Distribution::Constant(1.0), kind, &mut init);
        let norm = conv.norm.as_mut().unwrap();
        norm.weight = init.frozen([1], 3.0);
        norm.bias = init.frozen([1], 5.0);
        norm.running_mean = Some(init.frozen([1], 7.0));
        norm.running_var = Some(init.frozen([1], 4.0));
        // (9 - 7) / √4 · 3 + 5 = 8.
        let x = tensor(&[9.0], [1, 1, 1, 1]);
        let y: f32 = conv.forward(x.clone()).into_scalar();
        assert!((y - 8.0).abs() < 1e-5);
        // With -10 added, the ReLU makes the output 0.
        let residual = tensor(&[-10.0], [1, 1, 1, 1]);
        let y: f32 = conv.forward_then(x, Some(residual), Activation::Relu).into_scalar();
        assert_eq!(y, 0.0);
    }
}
