//! The extension on `Flex`: conversion between tensors and slices, and the choice of the kernel.

use std::sync::Arc;

use burn::backend::flex::FlexTensor;
use burn::backend::ops::{ActivationOps, ModuleOps};
use burn::backend::tensor::FloatTensor;
use burn::backend::{Flex, TensorMetadata};

use crate::adamw;
use crate::conv::kernel as conv;
use crate::conv::panels::Direction;
use crate::conv::shape::ConvShape;
use crate::cosines;
use crate::extension::KernelBackend;
use crate::flex_tensor::{
    all_f32, channels_last, contiguous, last_values, shape4, tensor, tensor_channels_last, values,
};
use crate::fully_connected;
use crate::group_norm;
use crate::packed::{self, Keep};
use crate::params::AdamWParams;
use crate::params::CosineParams;
use crate::params::MaxPool2dParams;
use crate::params::RoiAlignParams;
use crate::params::{Activation, FusedGroupNormParams};
use crate::params::{Conv2dParams, FusedConv2dParams};
use crate::product::Epilogue;
use crate::resize;
use crate::resize::kernel::PoolShape;
use crate::roi_align;
use crate::simd::Isa;
use crate::{composed, log_softmax, permute};

impl KernelBackend for Flex {
    fn kernel_conv2d(
        x: FloatTensor<Self>,
        weight: FloatTensor<Self>,
        bias: FloatTensor<Self>,
        scale: FloatTensor<Self>,
        residual: FloatTensor<Self>,
        params: FusedConv2dParams,
    ) -> FloatTensor<Self> {
        if !all_f32([&x, &weight, &bias, &scale, &residual]) {
            return composed::conv2d::<Self>(x, weight, bias, scale, residual, params);
        }
        let shape = ConvShape::forward(shape4(&x), shape4(&weight), params.conv);
        let (x, residual) = (channels_last(x), params.added.then(|| channels_last(residual)));
        let [bias, scale] = [bias, scale].map(|tensor| tensor.to_contiguous());
        let epilogue = Epilogue {
            scale: params.scaled.then(|| values(&scale)),
            bias: Some(values(&bias)),
            residual: residual.as_ref().map(last_values),
            relu: params.activation == Activation::Relu,
        };
        convolved(Direction::Forward, &x, weight, epilogue, &shape, Keep::Yes)
    }

    fn kernel_conv_transpose2d(
        x: FloatTensor<Self>,
        weight: FloatTensor<Self>,
        bias: FloatTensor<Self>,
        params: Conv2dParams,
    ) -> FloatTensor<Self> {
        if !all_f32([&x, &weight, &bias]) {
            return composed::conv_transpose2d::<Self>(x, weight, bias, params);
        }
        // A transposed convolution computes a convolution's gradient with respect to its input.
        let shape = ConvShape::transposed(shape4(&x), shape4(&weight), params);
        let (x, bias) = (channels_last(x), bias.to_contiguous());
        let epilogue = Epilogue { bias: Some(values(&bias)), ..Epilogue::default() };
        convolved(Direction::Backward, &x, weight, epilogue, &shape, Keep::Yes)
    }

    fn kernel_roi_align(
        features: FloatTensor<Self>,
        rois: FloatTensor<Self>,
        params: RoiAlignParams,
    ) -> FloatTensor<Self> {
        if !all_f32([&features, &rois]) {
            return composed::roi_align::<Self>(features, rois, params);
        }
        let features = channels_last(features);
        let rois = rois.to_contiguous();
        let shape = shape4(&features);
        let num_rois = rois.shape()[0];
        let crops = roi_align::kernel::forward(last_values(&features), shape, values(&rois), &params);
        let [bins_y, bins_x] = params.output_size;
        tensor_channels_last(crops, [num_rois, shape[1], bins_y, bins_x])
    }

    fn kernel_fully_connected(
        x: FloatTensor<Self>,
        weight: FloatTensor<Self>,
        bias: FloatTensor<Self>,
        activation: Activation,
    ) -> FloatTensor<Self> {
        if !all_f32([&x, &weight, &bias]) {
            return composed::fully_connected::<Self>(x, weight, bias, activation);
        }
        fully_connected::convolved::<Self>(x, weight, bias, activation)
    }

    fn kernel_group_norm(
        x: FloatTensor<Self>,
        gamma: FloatTensor<Self>,
        beta: FloatTensor<Self>,
        residual: FloatTensor<Self>,
        params: FusedGroupNormParams,
    ) -> FloatTensor<Self> {
        if !all_f32([&x, &gamma, &beta, &residual]) {
            return composed::group_norm::<Self>(x, gamma, beta, residual, params);
        }
        let shape = shape4(&x);
        let (x, residual) = (channels_last(x), params.added.then(|| channels_last(residual)));
        let [gamma, beta] = [gamma, beta].map(|tensor| tensor.to_contiguous());
        let [gamma, beta] = [&gamma, &beta].map(values);
        let residual = residual.as_ref().map(last_values);
        let x = last_values(&x);
        let (output, _) = group_norm::kernel::forward(Isa::detect(), x, shape, gamma, beta, residual, &params.norm);
        tensor_channels_last(output, shape)
    }

    fn kernel_max_pool2d(x: FloatTensor<Self>, params: MaxPool2dParams) -> FloatTensor<Self> {
        if !all_f32([&x]) {
            return Self::max_pool2d(x, params.kernel, params.stride, params.padding, [1, 1], false);
        }
        let shape = PoolShape::new(shape4(&x), params);
        let x = channels_last(x);
        tensor_channels_last(resize::kernel::max_pool(Isa::detect(), last_values(&x), &shape), shape.output())
    }

    fn kernel_log_softmax(x: FloatTensor<Self>) -> FloatTensor<Self> {
        if !all_f32([&x]) {
            return Self::log_softmax(x, 1);
        }
        let x = x.to_contiguous();
        let shape = [x.shape()[0], x.shape()[1]];
        tensor(log_softmax::forward(Isa::detect(), values(&x), shape[1]).0, shape)
    }

    fn kernel_cosines(one: FloatTensor<Self>, other: FloatTensor<Self>, params: CosineParams) -> FloatTensor<Self> {
        if !all_f32([&one, &other]) {
            return composed::cosines::<Self>(one, other, params);
        }
        let shape = shape4(&one);
        let [one, other] = [one, other].map(channels_last);
        let (found, _) = cosines::forward(Isa::detect(), last_values(&one), last_values(&other), shape, params);
        let side = 2 * params.reach + 1;
        tensor(found, [shape[0], side * side, shape[2], shape[3]])
    }

    fn kernel_adamw_moments(
        grad: FloatTensor<Self>,
        moments: FloatTensor<Self>,
        params: AdamWParams,
    ) -> FloatTensor<Self> {
        if !all_f32([&grad, &moments]) {
            return composed::adamw_moments::<Self>(grad, moments, params);
        }
        let [grad, moments] = [grad, moments].map(contiguous);
        let after = adamw::moments_after(Isa::detect(), values(&grad), values(&moments), params);
        tensor(after, [2, values(&grad).len()])
    }

    fn kernel_adamw_value(
        param: FloatTensor<Self>,
        moments: FloatTensor<Self>,
        params: AdamWParams,
    ) -> FloatTensor<Self> {
        if !all_f32([&param, &moments]) {
            return composed::adamw_value::<Self>(param, moments, params);
        }
        let [param, moments] = [param, moments].map(contiguous);
        let after = adamw::value_after(Isa::detect(), values(&param), values(&moments), params);
        tensor(after, [1, values(&param).len()])
    }

    fn kernel_permute_maps(x: FloatTensor<Self>, order: Arc<[usize]>) -> FloatTensor<Self> {
        if !all_f32([&x]) {
            return composed::permute_maps::<Self>(x, &order);
        }
        let shape = shape4(&x);
        tensor(permute::permuted(values(&x.to_contiguous()), &order), shape)
    }

    fn kernel_upsample_nearest_2x(x: FloatTensor<Self>) -> FloatTensor<Self> {
        if !all_f32([&x]) {
            return composed::upsample_nearest_2x::<Self>(x);
        }
        let [n, c, h, w] = shape4(&x);
        let x = channels_last(x);
        tensor_channels_last(resize::kernel::upsample(last_values(&x), [n, c, h, w]), [n, c, 2 * h, 2 * w])
    }
}

/// Convolves a channels-last tensor, in either direction.
pub(crate) fn convolved(
    direction: Direction,
    source: &FlexTensor,
    weight: FlexTensor,
    epilogue: Epilogue<'_>,
    shape: &ConvShape,
    keep: Keep,
) -> FlexTensor {
    let isa = Isa::detect();
    // A contiguous copy would be a new tensor each time, so that caching its packed form is useless.
    let keep = if weight.is_contiguous() { keep } else { Keep::No };
    let weight = weight.to_contiguous();
    let filters = |winograd| packed::filters(isa, &weight, shape, direction, winograd, keep);
    let output = conv::convolve(isa, direction, last_values(source), &filters, epilogue, shape);
    match direction {
        Direction::Forward => tensor_channels_last(output, shape.output()),
        Direction::Backward => tensor_channels_last(output, shape.input()),
    }
}
