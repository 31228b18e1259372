//! The extension on `Flex`: tensors to slices and back, and which kernel runs.

use burn::backend::flex::{FlexTensor, Layout};
use burn::backend::tensor::FloatTensor;
use burn::backend::{Flex, TensorMetadata};
use burn::tensor::{Bytes, DType, Shape};

use crate::composed;
use crate::extension::KernelBackend;
use crate::roi_align::{self, RoiAlignParams};

impl KernelBackend for Flex {
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
}

/// The kernels are for `f32`; other float types take the composed default.
pub(crate) fn all_f32<const N: usize>(tensors: [&FlexTensor; N]) -> bool {
    tensors.iter().all(|tensor| tensor.dtype() == DType::F32)
}

/// The values of a contiguous `f32` tensor, first to last.
pub(crate) fn values(tensor: &FlexTensor) -> &[f32] {
    tensor
        .as_slice()
        .expect("made contiguous and known to be f32 by the caller")
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
