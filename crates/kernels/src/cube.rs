//! The extension on burn's `Cube`, which is every device that CubeCL compiles for: wgpu's and CUDA's.
//!
//! burn's own operations are fast there, so the composed defaults serve, but for ROIAlign: its default asks the device
//! for the ROIs and so waits, once for every level of the pyramid and every head, until all that was ordered before is
//! done. A kernel of ours reads them where they are. Gradients go through the default, whose matrix products burn knows
//! how to differentiate.

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
