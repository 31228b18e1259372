//! The extension on `Flex`: tensors to slices and back, and which kernel runs.

use burn::backend::flex::{FlexTensor, Layout};
use burn::backend::tensor::FloatTensor;
use burn::backend::{Flex, TensorMetadata};
use burn::tensor::{Bytes, DType, Shape};

use crate::composed;
use crate::conv::Conv2dParams;
use crate::conv::kernel::{self as conv, ConvShape};
use crate::extension::KernelBackend;
use crate::group_norm::{self, GroupNormParams};
use crate::roi_align::{self, RoiAlignParams};
use crate::simd::Isa;

impl KernelBackend for Flex {
    fn kernel_conv2d(
        x: FloatTensor<Self>,
        weight: FloatTensor<Self>,
        bias: FloatTensor<Self>,
        params: Conv2dParams,
    ) -> FloatTensor<Self> {
        if !all_f32([&x, &weight, &bias]) {
            return composed::conv2d::<Self>(x, weight, bias, params);
        }
        let shape = ConvShape::forward(shape4(&x), shape4(&weight), params);
        let [x, weight, bias] = [x, weight, bias].map(|tensor| tensor.to_contiguous());
        let output = conv::forward(Isa::detect(), values(&x), values(&weight), Some(values(&bias)), &shape);
        tensor(output, shape.output())
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
        let [x, weight, bias] = [x, weight, bias].map(|tensor| tensor.to_contiguous());
        let output = conv::input_gradient(Isa::detect(), values(&x), values(&weight), Some(values(&bias)), &shape);
        tensor(output, shape.input())
    }

    fn kernel_roi_align(
        features: FloatTensor<Self>,
        rois: FloatTensor<Self>,
        params: RoiAlignParams,
    ) -> FloatTensor<Self> {
        if !all_f32([&features, &rois]) {
            return composed::roi_align::<Self>(features, rois, params);
        }
        let features = features.to_contiguous();
        let rois = rois.to_contiguous();
        let shape = shape4(&features);
        let num_rois = rois.shape()[0];
        let crops = roi_align::kernel::forward(values(&features), shape, values(&rois), &params);
        let [bins_y, bins_x] = params.output_size;
        tensor(crops, [num_rois, shape[1], bins_y, bins_x])
    }

    fn kernel_group_norm(
        x: FloatTensor<Self>,
        gamma: FloatTensor<Self>,
        beta: FloatTensor<Self>,
        params: GroupNormParams,
    ) -> FloatTensor<Self> {
        if !all_f32([&x, &gamma, &beta]) {
            return composed::group_norm::<Self>(x, gamma, beta, params);
        }
        let shape = shape4(&x);
        let [x, gamma, beta] = [x, gamma, beta].map(|tensor| tensor.to_contiguous());
        let (output, _) =
            group_norm::kernel::forward(Isa::detect(), values(&x), shape, values(&gamma), values(&beta), &params);
        tensor(output, shape)
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
