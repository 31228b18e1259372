//! The extension on `Flex`: tensors to slices and back, and which kernel runs.

use std::sync::Arc;

use burn::backend::flex::{FlexTensor, Layout};
use burn::backend::ops::ModuleOps;
use burn::backend::tensor::FloatTensor;
use burn::backend::{Flex, TensorMetadata};
use burn::tensor::{Bytes, DType, Shape};

use crate::adamw::{self, AdamWParams};
use crate::conv::filters::Direction;
use crate::conv::kernel::{self as conv, ConvShape};
use crate::conv::{Conv2dParams, FusedConv2dParams};
use crate::extension::KernelBackend;
use crate::group_norm::{self, Activation, FusedGroupNormParams};
use crate::packed::{self, Keep};
use crate::product::Epilogue;
use crate::resize::kernel::PoolShape;
use crate::resize::{self, MaxPool2dParams};
use crate::roi_align::{self, RoiAlignParams};
use crate::simd::Isa;
use crate::{composed, elementwise, permute};

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
        // A transposed convolution is what carries a convolution's gradient back to its input.
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

    fn kernel_adamw_moments(
        grad: FloatTensor<Self>,
        moments: FloatTensor<Self>,
        params: AdamWParams,
    ) -> FloatTensor<Self> {
        if !all_f32([&grad, &moments]) {
            return composed::adamw_moments::<Self>(grad, moments, params);
        }
        let [grad, moments] = [grad, moments].map(|tensor| tensor.to_contiguous());
        let after = adamw::moments_after(Isa::detect(), values(&grad), values(&moments), params);
        tensor(after, [2, grad.shape()[1]])
    }

    fn kernel_adamw_value(
        param: FloatTensor<Self>,
        moments: FloatTensor<Self>,
        params: AdamWParams,
    ) -> FloatTensor<Self> {
        if !all_f32([&param, &moments]) {
            return composed::adamw_value::<Self>(param, moments, params);
        }
        let [param, moments] = [param, moments].map(|tensor| tensor.to_contiguous());
        let after = adamw::value_after(Isa::detect(), values(&param), values(&moments), params);
        tensor(after, [1, param.shape()[1]])
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

/// Convolves a tensor that stands channels last, in either direction.
pub(crate) fn convolved(
    direction: Direction,
    source: &FlexTensor,
    weight: FlexTensor,
    epilogue: Epilogue<'_>,
    shape: &ConvShape,
    keep: Keep,
) -> FlexTensor {
    let isa = Isa::detect();
    // A copy would be another tensor each time, not worth remembering.
    let keep = if weight.is_contiguous() { keep } else { Keep::No };
    let weight = weight.to_contiguous();
    let filters = |winograd| packed::filters(isa, &weight, shape, direction, winograd, keep);
    let output = conv::convolve(isa, direction, last_values(source), &filters, epilogue, shape);
    match direction {
        Direction::Forward => tensor_channels_last(output, shape.output()),
        Direction::Backward => tensor_channels_last(output, shape.input()),
    }
}

/// The kernels are for `f32`; other float types take the composed default.
pub(crate) fn all_f32<const N: usize>(tensors: [&FlexTensor; N]) -> bool {
    tensors.iter().all(|tensor| tensor.dtype() == DType::F32)
}

/// The values of a contiguous `f32` tensor, first to last.
pub(crate) fn values(tensor: &FlexTensor) -> &[f32] {
    tensor.as_slice().expect("made contiguous and known to be f32 by the caller")
}

/// A tensor that takes the values over.
pub(crate) fn tensor<const D: usize>(values: Vec<f32>, shape: [usize; D]) -> FlexTensor {
    let layout = Layout::contiguous(Shape::from(shape));
    FlexTensor::new(Bytes::from_elems(values), layout, DType::F32)
}

/// The dimensions of a tensor known to have four.
pub(crate) fn shape4(tensor: &FlexTensor) -> [usize; 4] {
    let shape = tensor.shape();
    [shape[0], shape[1], shape[2], shape[3]]
}

/// Steps between the elements of a `[N, C, H, W]` tensor that stands channels last.
fn channels_last_strides([_, channels, height, width]: [usize; 4]) -> [usize; 4] {
    [height * width * channels, 1, width * channels, channels]
}

fn is_channels_last(tensor: &FlexTensor) -> bool {
    let shape = shape4(tensor);
    let strides = tensor.layout().strides();
    // Along an axis of one element no step is taken.
    let fits = |axis: usize| shape[axis] == 1 || strides[axis] == channels_last_strides(shape)[axis] as isize;
    (0..4).all(fits)
}

/// The same tensor, standing channels last.
pub(crate) fn channels_last(tensor: FlexTensor) -> FlexTensor {
    if is_channels_last(&tensor) {
        return tensor;
    }
    let shape = shape4(&tensor);
    let [num_images, channels, height, width] = shape;
    let tensor = tensor.to_contiguous();
    let moved = elementwise::channels_last(Isa::detect(), values(&tensor), num_images, channels, height * width);
    tensor_channels_last(moved, shape)
}

/// The values of an `f32` tensor that stands channels last, `[N, H, W, C]`.
pub(crate) fn last_values(tensor: &FlexTensor) -> &[f32] {
    let start = tensor.layout().start_offset();
    let len: usize = shape4(tensor).iter().product();
    &tensor.storage::<f32>()[start..start + len]
}

/// A tensor of shape `[N, C, H, W]` that takes over values that stand channels last.
pub(crate) fn tensor_channels_last(values: Vec<f32>, shape: [usize; 4]) -> FlexTensor {
    let strides = channels_last_strides(shape).map(|stride| stride as isize);
    let layout = Layout::new(Shape::from(shape), strides.to_vec(), 0);
    FlexTensor::new(Bytes::from_elems(values), layout, DType::F32)
}
