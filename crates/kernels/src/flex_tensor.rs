//! Values of flex's tensors, and channels-last maps in them.

use burn::backend::TensorMetadata;
use burn::backend::flex::{FlexTensor, Layout};
use burn::tensor::{Bytes, DType, Shape};

use crate::elementwise;
use crate::simd::Isa;

/// Whether all tensors are `f32`, which the kernels need; other float types use the composed default.
pub(crate) fn all_f32<const N: usize>(tensors: [&FlexTensor; N]) -> bool {
    tensors.iter().all(|tensor| tensor.dtype() == DType::F32)
}

/// The values of a contiguous `f32` tensor, first to last.
pub(crate) fn values(tensor: &FlexTensor) -> &[f32] {
    tensor.as_slice().expect("made contiguous and known to be f32 by the caller")
}

/// A tensor that takes ownership of the values.
pub(crate) fn tensor<const D: usize>(values: Vec<f32>, shape: [usize; D]) -> FlexTensor {
    let layout = Layout::contiguous(Shape::from(shape));
    FlexTensor::new(Bytes::from_elems(values), layout, DType::F32)
}

/// The dimensions of a tensor known to have four.
pub(crate) fn shape4(tensor: &FlexTensor) -> [usize; 4] {
    let shape = tensor.shape();
    [shape[0], shape[1], shape[2], shape[3]]
}

/// Strides of a channels-last `[N, C, H, W]` tensor.
fn channels_last_strides([_, channels, height, width]: [usize; 4]) -> [usize; 4] {
    [height * width * channels, 1, width * channels, channels]
}

fn is_channels_last(tensor: &FlexTensor) -> bool {
    let shape = shape4(tensor);
    let strides = tensor.layout().strides();
    // The stride of an axis of one element is not used.
    let fits = |axis: usize| shape[axis] == 1 || strides[axis] == channels_last_strides(shape)[axis] as isize;
    (0..4).all(fits)
}

/// Converts a tensor to channels-last layout.
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

/// Makes a tensor contiguous. A transposed matrix, such as the gradient of a fully connected layer, is transposed by
/// our own kernel.
pub(crate) fn contiguous(tensor: FlexTensor) -> FlexTensor {
    let shape = tensor.shape();
    let strides = tensor.layout().strides();
    if shape.num_dims() != 2 || shape[0] == 1 || strides[0] != 1 || strides[1] != shape[0] as isize {
        return tensor.to_contiguous();
    }
    let [rows, columns] = [shape[0], shape[1]];
    let start = tensor.layout().start_offset();
    let stored = &tensor.storage::<f32>()[start..start + rows * columns];
    self::tensor(elementwise::channels_last(Isa::detect(), stored, 1, columns, rows), [rows, columns])
}

/// The values of a channels-last `f32` tensor, `[N, H, W, C]`.
pub(crate) fn last_values(tensor: &FlexTensor) -> &[f32] {
    let start = tensor.layout().start_offset();
    let len: usize = shape4(tensor).iter().product();
    &tensor.storage::<f32>()[start..start + len]
}

/// A tensor of shape `[N, C, H, W]` that takes ownership of channels-last values.
pub(crate) fn tensor_channels_last(values: Vec<f32>, shape: [usize; 4]) -> FlexTensor {
    let strides = channels_last_strides(shape).map(|stride| stride as isize);
    let layout = Layout::new(Shape::from(shape), strides.to_vec(), 0);
    FlexTensor::new(Bytes::from_elems(values), layout, DType::F32)
}
