//! CPU kernels for the most expensive operations of a detector, behind burn's backend extension.
//!
//! burn's CPU backend `Flex` runs a convolution forwards at a moderate speed and backwards through a generic fallback,
//! and it has no ROIAlign. This crate adds faster convolutions (most 3×3 convolutions of stride 1 by Winograd's
//! transforms, all others as matrix products that mostly read the maps in place), fully connected layers over maps,
//! ROIAlign, and the other operations that took most of the training time: group norm, max pooling, upsampling,
//! log-softmax, cosines between maps, AdamW's update, and non-maximum suppression.
//!
//! ```text
//! conv2d(x, w, b)                         the function a model calls, on `burn::tensor::Tensor`
//!   └─ KernelBackend::kernel_conv2d       the backend extension: one method per operation
//!        ├─ Flex                          hand-written kernel on f32 slices
//!        ├─ Autodiff<Flex>                the same, with a hand-written backward
//!        ├─ Cube                          ROIAlign on wgpu and CUDA; otherwise the default body
//!        └─ any other backend             the default body: burn's own tensor operations
//! ```
//!
//! Tensors are `[N, C, H, W]`, contiguous or not; maps that the kernels return, except those of `cosines` and
//! `permute_maps`, are channels last in memory (`[N, H, W, C]`, visible from their strides), so that the next operation
//! of this crate reads them in place. The kernels are for `f32`; any other float type takes the composed default.
//! Results are bit-identical for any number of threads.
//!
//! Deliberately not included: groups and dilation (no detector here has them), gradients with respect
//! to ROI coordinates (the R-CNN family treats proposals as constants), and GPU kernels other than ROIAlign's.
//!
//! ```
//! use burn::tensor::{Device, Tensor};
//! use sdg_kernels::{Conv2dParams, conv2d, nms};
//!
//! let device = Device::flex();
//! let image = Tensor::<4>::ones([1, 1, 4, 4], &device);
//! let box_blur = Tensor::<4>::ones([1, 1, 3, 3], &device) / 9.0;
//! let params = Conv2dParams { stride: [1, 1], padding: [1, 1] };
//! let blurred = conv2d(image, box_blur, None, params);
//! assert_eq!(blurred.dims(), [1, 1, 4, 4]);
//! // Four of the nine pixels of a corner's window are inside.
//! let corner: f32 = blurred.slice([0..1, 0..1, 0..1, 0..1]).into_scalar();
//! assert!((corner - 4.0 / 9.0).abs() < 1e-6);
//!
//! let boxes = [[0.0, 0.0, 10.0, 10.0], [1.0, 0.0, 11.0, 10.0], [50.0, 50.0, 60.0, 60.0]];
//! assert_eq!(nms(&boxes, &[0.9, 0.8, 0.7], 0.5), [0, 2]);
//! ```
#![cfg_attr(test, allow(clippy::unwrap_used))]
// Backward passes are also compiled without `autodiff`, and then never called.
#![cfg_attr(not(feature = "autodiff"), allow(dead_code, unused_imports))]
// burn has deprecated its backend on ndarray; the feature remains available.
#![cfg_attr(feature = "ndarray", allow(deprecated))]

mod adamw;
#[cfg(feature = "autodiff")]
mod autodiff;
pub mod composed;
mod conv;
mod cosines;
#[cfg(any(feature = "wgpu", feature = "cuda"))]
mod cube;
mod elementwise;
mod extension;
mod flex;
mod flex_tensor;
mod fully_connected;
mod group_norm;
mod log_softmax;
mod memory;
#[cfg(feature = "ndarray")]
mod ndarray;
mod nms;
mod packed;
mod parallel;
mod params;
mod permute;
mod product;
#[cfg(test)]
mod reference;
mod resize;
mod roi_align;
mod roi_bins;
mod scratch;
mod simd;

pub use adamw::adamw;
pub use conv::{Conv2dEpilogue, conv_transpose2d, conv2d, conv2d_fused};
pub use cosines::cosines;
pub use extension::KernelBackend;
pub use fully_connected::fully_connected;
pub use group_norm::{group_norm, group_norm_residual};
pub use log_softmax::log_softmax;
pub use memory::keep_freed_memory;
pub use nms::{batched_nms, nms};
pub use parallel::for_each_stretch;
pub use params::AdamWParams;
pub use params::CosineParams;
pub use params::MaxPool2dParams;
pub use params::{Activation, FusedGroupNormParams, GroupNormParams};
pub use params::{Conv2dParams, FusedConv2dParams};
pub use params::{RoiAlignParams, RoiAlignment, SamplingRatio};
pub use permute::permute_maps;
pub use resize::{max_pool2d, upsample_nearest_2x};
pub use roi_align::roi_align;
