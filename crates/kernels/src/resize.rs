//! Max pooling, and doubling by repetition: the changes of resolution other than strides.
//!
//! Results are channels last in memory, like those of [`conv2d`](crate::conv2d).

use burn::backend::Dispatch;
use burn::tensor::Tensor;

use crate::extension::KernelBackend;
use crate::params::MaxPool2dParams;

pub(crate) mod kernel;
#[cfg(test)]
mod tests;

/// The maximum of every window. A NaN is larger than any number; of equal values the first gets the gradient.
///
/// # Shapes
/// `x` `[N, C, Hi, Wi]`; the result is `[N, C, Ho, Wo]` with `Ho = (Hi + 2·padding − Kh) / stride + 1`, rounded down.
///
/// # Panics
/// If a dimension, stride or side of the window is 0, the window has more than 255 pixels, the padding is more than
/// half the window, or the window is larger than the padded input.
pub fn max_pool2d(x: Tensor<4>, params: MaxPool2dParams) -> Tensor<4> {
    let [_, _, height, width] = x.dims();
    let MaxPool2dParams { kernel, stride, padding } = params;
    assert!(x.dims().iter().all(|&size| size > 0), "max_pool2d: expected no empty dimension, found {:?}", x.dims());
    assert!(
        kernel.iter().chain(&stride).all(|&size| size > 0) && kernel[0] * kernel[1] <= 255,
        "max_pool2d: expected strides of at least 1 and a window of 1 to 255 pixels, found {params:?}"
    );
    assert!(
        (0..2).all(|axis| 2 * padding[axis] <= kernel[axis]),
        "max_pool2d: expected padding of at most half the window, found {params:?}"
    );
    assert!(
        params.output_size([height, width]).is_some(),
        "max_pool2d: expected a padded input of at least the window's {kernel:?}, found {height} x {width}"
    );
    Tensor::from_dispatch(Dispatch::kernel_max_pool2d(x.into_dispatch(), params))
}

/// Doubles height and width by repeating each pixel.
///
/// # Shapes
/// `x` `[N, C, H, W]`; the result is `[N, C, 2H, 2W]`.
pub fn upsample_nearest_2x(x: Tensor<4>) -> Tensor<4> {
    Tensor::from_dispatch(Dispatch::kernel_upsample_nearest_2x(x.into_dispatch()))
}
