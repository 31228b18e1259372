//! ROIAlign on `f32` slices, forwards and backwards.
//!
//! Maps and crops are channels last: a pixel is one run of C floats, and every weight is applied to a whole run.

use crate::parallel::{SharedSlice, for_each_unit};
use crate::params::RoiAlignParams;
use crate::roi_bins::RoiBins;
use crate::simd::{Isa, widest};

/// Number of channels per unit of the backward pass.
const CHANNEL_BLOCK: usize = 16;

/// Crops of `features` `[N, H, W, C]` at `rois` `[R, 5]`: `[R, Ph, Pw, C]`. The shape is `[N, C, H, W]`.
pub(crate) fn forward(features: &[f32], shape: [usize; 4], rois: &[f32], params: &RoiAlignParams) -> Vec<f32> {
    let isa = Isa::detect();
    let [num_images, channels, height, width] = shape;
    let [bins_y, bins_x] = params.output_size;
    let num_bins = bins_y * bins_x;
    let num_rois = rois.len() / 5;
    let mut output = vec![0.0; num_rois * num_bins * channels];
    let crops = SharedSlice::new(&mut output);
    for_each_unit(num_rois, |roi_idx| {
        let roi = &rois[roi_idx * 5..roi_idx * 5 + 5];
        let bins = RoiBins::new(roi, roi_idx, num_images, [height, width], params);
        let image = &features[bins.image_idx * height * width * channels..];
        // SAFETY: every unit has its own ROI's crop.
        let crop = unsafe { crops.range(roi_idx * channels * num_bins, channels * num_bins) };
        for (bin, sum) in crop.chunks_exact_mut(channels).enumerate() {
            let (first_y, weights_y) = bins.y.bin(bin / bins_x);
            let (first_x, weights_x) = bins.x.bin(bin % bins_x);
            for (y, weight_y) in (first_y..).zip(weights_y) {
                for (x, weight_x) in (first_x..).zip(weights_x) {
                    let at = (y * width + x) * channels;
                    add_scaled(isa, sum, &image[at..at + channels], weight_y * weight_x);
                }
            }
        }
    });
    output
}

/// Gradient with respect to the features, `[N, H, W, C]`, from the gradient of the crops, `[R, Ph, Pw, C]`.
pub(crate) fn backward(crop_grad: &[f32], shape: [usize; 4], rois: &[f32], params: &RoiAlignParams) -> Vec<f32> {
    let isa = Isa::detect();
    let [num_images, channels, height, width] = shape;
    let [bins_y, bins_x] = params.output_size;
    let bins: Vec<RoiBins> = rois
        .chunks_exact(5)
        .enumerate()
        .map(|(idx, roi)| RoiBins::new(roi, idx, num_images, [height, width], params))
        .collect();
    let mut output = vec![0.0; num_images * height * width * channels];
    let maps = SharedSlice::new(&mut output);
    let channel_blocks = channels.div_ceil(CHANNEL_BLOCK);
    for_each_unit(num_images * channel_blocks, |unit| {
        let image_idx = unit / channel_blocks;
        let first_channel = unit % channel_blocks * CHANNEL_BLOCK;
        let block = CHANNEL_BLOCK.min(channels - first_channel);
        // ROIs are added in order, independent of the threads.
        for (roi_idx, bins) in bins.iter().enumerate().filter(|(_, bins)| bins.image_idx == image_idx) {
            for bin in 0..bins_y * bins_x {
                let at = (roi_idx * bins_y * bins_x + bin) * channels + first_channel;
                let grad = &crop_grad[at..at + block];
                let (first_y, weights_y) = bins.y.bin(bin / bins_x);
                let (first_x, weights_x) = bins.x.bin(bin % bins_x);
                for (y, weight_y) in (first_y..).zip(weights_y) {
                    for (x, weight_x) in (first_x..).zip(weights_x) {
                        let at = ((image_idx * height + y) * width + x) * channels + first_channel;
                        // SAFETY: every unit has its own image and channels.
                        let pixel = unsafe { maps.range(at, block) };
                        add_scaled(isa, pixel, grad, weight_y * weight_x);
                    }
                }
            }
        }
    });
    output
}

widest! {
    fn add_scaled(sum: &mut [f32], values: &[f32], weight: f32) -> () {
        for (sum, value) in sum.iter_mut().zip(values) {
            *sum += weight * value;
        }
    }
}
