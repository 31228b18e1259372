//! ROIAlign: feature maps to crops of one size, by bilinear samples averaged over each bin.
//!
//! Shapes: N images, C channels, maps of H × W, R regions of interest, crops of Ph × Pw bins.
//!
//! Glossary: *ROI*, a box in image pixels with the index of its image; *bin*, one cell of the crop; *grid*, the samples
//! that a bin averages along one axis. Bilinear sampling and averaging are separable, so a bin is `Σ_y Σ_x weight_y ·
//! weight_x · feature(y, x)`, and [`AxisBins`](crate::roi_bins::AxisBins) holds the weights of one axis.
//!
//! Source: He et al., Mask R-CNN (2017), section 3; the conventions of Detectron2's `ROIAlign` (`aligned`) and
//! torchvision's `roi_align`, which differ by [`RoiAlignment`](crate::RoiAlignment). Two intended differences: samples
//! are weighted in per-axis order, so the last bits differ, and an ROI with a non-finite corner gives zeros.

use burn::backend::Dispatch;
use burn::tensor::Tensor;

use crate::extension::KernelBackend;
use crate::params::{RoiAlignParams, SamplingRatio};

pub(crate) mod kernel;
#[cfg(test)]
mod tests;

/// Crops `features` at `rois` into maps of one size.
///
/// Differentiable with respect to `features`; `rois` are constants.
///
/// # Shapes
/// `features` `[N, C, H, W]`, `rois` `[R, 5]` of `(image index, x1, y1, x2, y2)` in image pixels; the result
/// is `[R, C, Ph, Pw]`. R may be 0.
///
/// # Panics
/// For other shapes; if the output size or a fixed sampling ratio is 0, the spatial scale is not positive and finite,
/// or `features` is empty while R > 0; and, except on wgpu and CUDA without autodiff, if an image index is not an
/// integer in `0..N`.
pub fn roi_align(features: Tensor<4>, rois: Tensor<2>, params: RoiAlignParams) -> Tensor<4> {
    let [num_images, channels, height, width] = features.dims();
    let [num_rois, columns] = rois.dims();
    assert!(columns == 5, "roi_align: expected ROIs of [R, 5] (image index, x1, y1, x2, y2), found {:?}", rois.dims());
    assert!(
        params.output_size.iter().all(|&bins| bins > 0),
        "roi_align: expected at least one bin per axis, found {:?}",
        params.output_size
    );
    assert!(
        params.sampling_ratio != SamplingRatio::Fixed(0),
        "roi_align: expected a sampling ratio of at least 1, found 0 (for adaptive use `Adaptive`)"
    );
    assert!(
        params.spatial_scale.is_finite() && params.spatial_scale > 0.0,
        "roi_align: expected a positive spatial scale, found {}",
        params.spatial_scale
    );
    let [bins_y, bins_x] = params.output_size;
    if num_rois == 0 {
        return Tensor::zeros([0, channels, bins_y, bins_x], (&features.device(), features.dtype()));
    }
    assert!(
        num_images * channels * height * width > 0,
        "roi_align: expected feature maps of at least one pixel, found {:?}",
        features.dims()
    );
    Tensor::from_dispatch(Dispatch::kernel_roi_align(features.into_dispatch(), rois.into_dispatch(), params))
}
