//! Group normalisation in two passes forwards and two backwards, optionally with the ReLU that follows it.
//!
//! Shapes: N images, C channels in G groups, P pixels; a group of an image has m = C/G · P values.
//!
//! Source: Wu and He, Group Normalization (2018), equations 1, 2 and 6; the variance is divided by m, as in
//! PyTorch's `group_norm`.

use burn::backend::Dispatch;
use burn::tensor::Tensor;

use crate::extension::KernelBackend;
use crate::params::{FusedGroupNormParams, GroupNormParams};

pub(crate) mod kernel;
#[cfg(test)]
mod tests;

/// Normalises each group of channels of each image to mean 0 and variance 1, then scales by `gamma` and shifts
/// by `beta`.
///
/// # Shapes
/// `x` `[N, C, H, W]`, `gamma` and `beta` `[C]`; the result has the shape of `x`.
///
/// # Panics
/// If the shapes do not match, a dimension is 0, or the groups do not divide the channels.
pub fn group_norm(x: Tensor<4>, gamma: Tensor<1>, beta: Tensor<1>, params: GroupNormParams) -> Tensor<4> {
    group_norm_residual(x, gamma, beta, None, params)
}

/// [`group_norm`] with a summand of the shape of `x` added before the activation: the end of a residual block.
///
/// # Shapes
/// As for [`group_norm`].
///
/// # Panics
/// As for [`group_norm`], and if the residual has another shape.
pub fn group_norm_residual(
    x: Tensor<4>,
    gamma: Tensor<1>,
    beta: Tensor<1>,
    residual: Option<Tensor<4>>,
    params: GroupNormParams,
) -> Tensor<4> {
    let channels = x.dims()[1];
    assert!(x.dims().iter().all(|&size| size > 0), "group_norm: expected no empty dimension, found {:?}", x.dims());
    assert!(
        params.num_groups > 0 && channels.is_multiple_of(params.num_groups),
        "group_norm: expected a number of groups that divides {channels} channels, found {}",
        params.num_groups
    );
    assert!(
        gamma.dims() == [channels] && beta.dims() == [channels],
        "group_norm: expected gamma and beta of [{channels}], found {:?} and {:?}",
        gamma.dims(),
        beta.dims()
    );
    let added = residual.is_some();
    let residual = residual.unwrap_or_else(|| Tensor::zeros([1; 4], (&x.device(), x.dtype())));
    assert!(
        !added || residual.dims() == x.dims(),
        "group_norm: expected a residual of {:?}, found {:?}",
        x.dims(),
        residual.dims()
    );
    Tensor::from_dispatch(Dispatch::kernel_group_norm(
        x.into_dispatch(),
        gamma.into_dispatch(),
        beta.into_dispatch(),
        residual.into_dispatch(),
        FusedGroupNormParams { norm: params, added },
    ))
}
