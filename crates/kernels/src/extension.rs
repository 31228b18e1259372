//! The backend extension: one method per operation, with a default body of burn's own tensor operations.

use std::sync::Arc;

use burn::backend::tensor::FloatTensor;
use burn::backend::{Backend, backend_extension};

use crate::composed;
use crate::params::Activation;
use crate::params::AdamWParams;
use crate::params::CosineParams;
use crate::params::FusedGroupNormParams;
use crate::params::MaxPool2dParams;
use crate::params::RoiAlignParams;
use crate::params::{Conv2dParams, FusedConv2dParams};

/// Backends that run this crate's operations.
///
/// The default bodies are differentiable compositions, so that another backend needs only `impl
/// KernelBackend for That {}`. Shapes were checked by the functions on [`Tensor`](burn::tensor::Tensor)
/// that call these methods.
#[backend_extension(
    Flex,
    NdArray: cfg(feature = "ndarray"),
    Cube: cfg(any(feature = "wgpu", feature = "cuda")),
    Autodiff: cfg(feature = "autodiff")
)]
pub trait KernelBackend: Backend {
    /// See [`conv2d_fused`](crate::conv2d_fused). If `params` have no scale or residual, a tensor of one zero is
    /// passed in its place.
    fn kernel_conv2d(
        x: FloatTensor<Self>,
        weight: FloatTensor<Self>,
        bias: FloatTensor<Self>,
        scale: FloatTensor<Self>,
        residual: FloatTensor<Self>,
        params: FusedConv2dParams,
    ) -> FloatTensor<Self> {
        composed::conv2d::<Self>(x, weight, bias, scale, residual, params)
    }

    /// See [`conv_transpose2d`](crate::conv_transpose2d).
    fn kernel_conv_transpose2d(
        x: FloatTensor<Self>,
        weight: FloatTensor<Self>,
        bias: FloatTensor<Self>,
        params: Conv2dParams,
    ) -> FloatTensor<Self> {
        composed::conv_transpose2d::<Self>(x, weight, bias, params)
    }

    /// See [`roi_align`](crate::roi_align).
    fn kernel_roi_align(
        features: FloatTensor<Self>,
        rois: FloatTensor<Self>,
        params: RoiAlignParams,
    ) -> FloatTensor<Self> {
        composed::roi_align::<Self>(features, rois, params)
    }

    /// See [`group_norm_residual`](crate::group_norm_residual). If `params` have no residual, a tensor of one zero
    /// is passed in its place.
    fn kernel_group_norm(
        x: FloatTensor<Self>,
        gamma: FloatTensor<Self>,
        beta: FloatTensor<Self>,
        residual: FloatTensor<Self>,
        params: FusedGroupNormParams,
    ) -> FloatTensor<Self> {
        composed::group_norm::<Self>(x, gamma, beta, residual, params)
    }

    /// See [`max_pool2d`](crate::max_pool2d).
    fn kernel_max_pool2d(x: FloatTensor<Self>, params: MaxPool2dParams) -> FloatTensor<Self> {
        Self::max_pool2d(x, params.kernel, params.stride, params.padding, [1, 1], false)
    }

    /// See [`upsample_nearest_2x`](crate::upsample_nearest_2x).
    fn kernel_upsample_nearest_2x(x: FloatTensor<Self>) -> FloatTensor<Self> {
        composed::upsample_nearest_2x::<Self>(x)
    }

    /// The moments of [`adamw`](crate::adamw()): `grad` has any shape of `count` values, `moments` and the
    /// result are `[2, count]`.
    fn kernel_adamw_moments(
        grad: FloatTensor<Self>,
        moments: FloatTensor<Self>,
        params: AdamWParams,
    ) -> FloatTensor<Self> {
        composed::adamw_moments::<Self>(grad, moments, params)
    }

    /// The value of [`adamw`](crate::adamw()): `param` has any shape of `count` values, `moments`, after the step,
    /// are `[2, count]`, and the result is `[1, count]`.
    fn kernel_adamw_value(
        param: FloatTensor<Self>,
        moments: FloatTensor<Self>,
        params: AdamWParams,
    ) -> FloatTensor<Self> {
        composed::adamw_value::<Self>(param, moments, params)
    }

    /// See [`fully_connected`](crate::fully_connected()).
    fn kernel_fully_connected(
        x: FloatTensor<Self>,
        weight: FloatTensor<Self>,
        bias: FloatTensor<Self>,
        activation: Activation,
    ) -> FloatTensor<Self> {
        composed::fully_connected::<Self>(x, weight, bias, activation)
    }

    /// See [`log_softmax`](crate::log_softmax()).
    fn kernel_log_softmax(x: FloatTensor<Self>) -> FloatTensor<Self> {
        Self::log_softmax(x, 1)
    }

    /// See [`cosines`](crate::cosines()).
    fn kernel_cosines(one: FloatTensor<Self>, other: FloatTensor<Self>, params: CosineParams) -> FloatTensor<Self> {
        composed::cosines::<Self>(one, other, params)
    }

    /// See [`permute_maps`](crate::permute_maps).
    fn kernel_permute_maps(x: FloatTensor<Self>, order: Arc<[usize]>) -> FloatTensor<Self> {
        composed::permute_maps::<Self>(x, &order)
    }
}
