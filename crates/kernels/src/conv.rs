//! Two-dimensional convolution and its transpose.
//!
//! On the CPU, `f32` results have the channels-last layout in memory, for any shape: further convolutions,
//! normalisations, poolings and crops of this crate then read them in place. Operations of burn accept them like any
//! permuted tensor.
//!
//! Shapes: N images, Ci channels in, Co channels out, a kernel of Kh × Kw, maps of Hi × Wi and Ho × Wo.

use burn::backend::Dispatch;
use burn::tensor::Tensor;

use crate::extension::KernelBackend;
use crate::params::{Activation, Conv2dParams, FusedConv2dParams};

pub(crate) mod direct;
pub(crate) mod filters;
pub(crate) mod kernel;
pub(crate) mod panels;
pub(crate) mod shape;
pub(crate) mod weight_gradient;
mod winograd;

#[cfg(test)]
mod kernel_tests;
#[cfg(test)]
mod tests;

/// Convolves `x` with `weight` (cross-correlation, as everywhere in deep learning) and adds `bias`.
///
/// # Shapes
/// `x` `[N, Ci, Hi, Wi]`, `weight` `[Co, Ci, Kh, Kw]`, `bias` `[Co]`; the result is `[N, Co, Ho, Wo]` with
/// `Ho = (Hi + 2·padding − Kh) / stride + 1`, rounded down.
///
/// # Panics
/// If the shapes do not match, a dimension or stride is 0, or the kernel is larger than the padded
/// input.
pub fn conv2d(x: Tensor<4>, weight: Tensor<4>, bias: Option<Tensor<1>>, params: Conv2dParams) -> Tensor<4> {
    conv2d_fused(x, weight, bias, params, Conv2dEpilogue::default())
}

/// Operations on a convolution's result before it is written: `activation(scale · conv + bias + residual)`.
#[derive(Clone, Debug, Default)]
pub struct Conv2dEpilogue {
    /// A factor for each channel, `[Co]`, such as that of a frozen batch norm. It is a constant without a gradient.
    pub scale: Option<Tensor<1>>,
    /// A summand of the result's shape.
    pub residual: Option<Tensor<4>>,
    /// Activation of the output.
    pub activation: Activation,
}

/// [`conv2d`] with an epilogue, in one pass over the result.
///
/// # Shapes
/// As for [`conv2d`].
///
/// # Panics
/// As for [`conv2d`], and if the epilogue's shapes do not match.
pub fn conv2d_fused(
    x: Tensor<4>,
    weight: Tensor<4>,
    bias: Option<Tensor<1>>,
    params: Conv2dParams,
    epilogue: Conv2dEpilogue,
) -> Tensor<4> {
    let [num_images, in_channels, in_height, in_width] = x.dims();
    let [out_channels, weight_channels, kernel_height, kernel_width] = weight.dims();
    check_parameters("conv2d", x.dims(), weight.dims(), params);
    assert!(
        weight_channels == in_channels,
        "conv2d: expected a weight of [Co, {in_channels}, Kh, Kw] for an input of {:?}, found {:?}",
        x.dims(),
        weight.dims(),
    );
    let out_size = params.output_size([in_height, in_width], [kernel_height, kernel_width]);
    assert!(
        out_size.is_some(),
        "conv2d: expected a padded input of at least the kernel's {kernel_height} x {kernel_width}, found \
         {num_images} maps of {in_height} x {in_width} with padding {:?}",
        params.padding,
    );
    let bias = bias_or_zeros("conv2d", bias, out_channels, &x);
    let Conv2dEpilogue { scale, residual, activation } = epilogue;
    let scaled = scale.is_some();
    let added = residual.is_some();
    let scale = scale.unwrap_or_else(|| absent(&x));
    assert!(
        !scaled || scale.dims() == [out_channels],
        "conv2d: expected a scale of [{out_channels}], found {:?}",
        scale.dims()
    );
    let residual = residual.unwrap_or_else(|| absent(&x));
    let out_dims = out_size.map(|[height, width]| [num_images, out_channels, height, width]);
    assert!(
        !added || Some(residual.dims()) == out_dims,
        "conv2d: expected a residual of the result's shape {out_dims:?}, found {:?}",
        residual.dims()
    );
    Tensor::from_dispatch(Dispatch::kernel_conv2d(
        x.into_dispatch(),
        weight.into_dispatch(),
        bias.into_dispatch(),
        scale.into_dispatch(),
        residual.into_dispatch(),
        FusedConv2dParams { conv: params, scaled, added, activation },
    ))
}

/// Placeholder for an absent tensor in the extension's methods.
fn absent<const D: usize>(x: &Tensor<4>) -> Tensor<D> {
    Tensor::zeros([1; D], (&x.device(), x.dtype()))
}

/// Transposed convolution: the linear function whose gradient with respect to its input is [`conv2d`].
///
/// # Shapes
/// `x` `[N, Ci, Hi, Wi]`, `weight` `[Ci, Co, Kh, Kw]` (input channels first, as in PyTorch), `bias` `[Co]`;
/// the result is `[N, Co, Ho, Wo]` with `Ho = (Hi − 1)·stride + Kh − 2·padding`.
///
/// # Panics
/// If the shapes do not match, a dimension or stride is 0, or the padding leaves no output.
pub fn conv_transpose2d(x: Tensor<4>, weight: Tensor<4>, bias: Option<Tensor<1>>, params: Conv2dParams) -> Tensor<4> {
    let [_, in_channels, in_height, in_width] = x.dims();
    let [weight_channels, out_channels, kernel_height, kernel_width] = weight.dims();
    check_parameters("conv_transpose2d", x.dims(), weight.dims(), params);
    assert!(
        weight_channels == in_channels,
        "conv_transpose2d: expected a weight of [{in_channels}, Co, Kh, Kw] for an input of {:?}, found {:?}",
        x.dims(),
        weight.dims(),
    );
    assert!(
        params.transposed_output_size([in_height, in_width], [kernel_height, kernel_width]).is_some(),
        "conv_transpose2d: expected padding that leaves an output, found {:?} for an input of {in_height} x \
         {in_width}, kernel {kernel_height} x {kernel_width}, stride {:?}",
        params.padding,
        params.stride,
    );
    let bias = bias_or_zeros("conv_transpose2d", bias, out_channels, &x);
    Tensor::from_dispatch(Dispatch::kernel_conv_transpose2d(
        x.into_dispatch(),
        weight.into_dispatch(),
        bias.into_dispatch(),
        params,
    ))
}

fn check_parameters(name: &str, x: [usize; 4], weight: [usize; 4], params: Conv2dParams) {
    assert!(
        x.iter().chain(&weight).all(|&size| size > 0),
        "{name}: expected no empty dimension, found input {x:?} and weight {weight:?}"
    );
    assert!(
        params.stride.iter().all(|&step| step > 0),
        "{name}: expected strides of at least 1, found {:?}",
        params.stride
    );
}

/// The bias, or zeros without a gradient in its place, because the extension's methods take no optional tensors.
fn bias_or_zeros(name: &str, bias: Option<Tensor<1>>, out_channels: usize, x: &Tensor<4>) -> Tensor<1> {
    match bias {
        Some(bias) => {
            assert!(
                bias.dims() == [out_channels],
                "{name}: expected a bias of [{out_channels}], found {:?}",
                bias.dims()
            );
            bias
        }
        None => Tensor::zeros([out_channels], (&x.device(), x.dtype())),
    }
}
