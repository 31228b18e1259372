//! The extension on burn's `Cube`, which covers every device that CubeCL compiles for: those of wgpu and CUDA.
//!
//! burn's own operations are fast there, so that the composed defaults suffice, except for ROIAlign: its default reads
//! the ROIs from the device and so waits, once for every level of the pyramid and every head, until all earlier work is
//! done. Our kernel reads them on the device. Gradients use the default, whose matrix products burn can differentiate.

use burn::backend::Cube;
use burn::backend::tensor::FloatTensor;
use burn::tensor::DType;

use crate::composed;
use crate::extension::KernelBackend;
use crate::params::RoiAlignParams;

mod roi_align;

impl KernelBackend for Cube {
    fn kernel_roi_align(
        features: FloatTensor<Self>,
        rois: FloatTensor<Self>,
        params: RoiAlignParams,
    ) -> FloatTensor<Self> {
        if features.dtype != DType::F32 || rois.dtype != DType::F32 {
            return composed::roi_align::<Self>(features, rois, params);
        }
        roi_align::launched(features, rois, params)
    }
}

#[cfg(feature = "autodiff")]
impl<C: burn::backend::autodiff::checkpoint::strategy::CheckpointStrategy> KernelBackend
    for burn::backend::Autodiff<Cube, C>
{
}
