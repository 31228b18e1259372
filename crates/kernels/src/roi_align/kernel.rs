//! ROIAlign on `f32` slices, forwards and backwards.
//!
//! Both work on channels-last copies of the maps, where a feature pixel is one run of C floats, so that
//! every weight is applied to a whole run.

use super::{RoiAlignParams, RoiBins};
use crate::parallel::{SharedSlice, for_each_unit};

/// Channels of the backward pass's units.
const CHANNEL_BLOCK: usize = 16;

/// Crops of `features` `[N, C, H, W]` at `rois` `[R, 5]`: `[R, C, Ph, Pw]`.
pub(crate) fn forward(features: &[f32], shape: [usize; 4], rois: &[f32], params: &RoiAlignParams) -> Vec<f32> {
    let [num_images, channels, height, width] = shape;
    let [bins_y, bins_x] = params.output_size;
    let num_bins = bins_y * bins_x;
    let features = channels_last(features, num_images, channels, height * width);
    let num_rois = rois.len() / 5;
    let mut output = vec![0.0; num_rois * channels * num_bins];
    let crops = SharedSlice::new(&mut output);
    for_each_unit(num_rois, |roi_idx| {
        let roi = &rois[roi_idx * 5..roi_idx * 5 + 5];
        let bins = RoiBins::new(roi, roi_idx, num_images, [height, width], params);
        let image = &features[bins.image_idx * height * width * channels..];
        // SAFETY: every unit has its own ROI's crop.
        let crop = unsafe { crops.range(roi_idx * channels * num_bins, channels * num_bins) };
        let mut pixel = vec![0.0; channels];
        for bin_y in 0..bins_y {
            let (first_y, weights_y) = bins.y.bin(bin_y);
            for bin_x in 0..bins_x {
                let (first_x, weights_x) = bins.x.bin(bin_x);
                pixel.fill(0.0);
                for (y, weight_y) in (first_y..).zip(weights_y) {
                    for (x, weight_x) in (first_x..).zip(weights_x) {
                        let at = (y * width + x) * channels;
                        add_scaled(&mut pixel, &image[at..at + channels], weight_y * weight_x);
                    }
                }
                for (channel, &value) in pixel.iter().enumerate() {
                    crop[channel * num_bins + bin_y * bins_x + bin_x] = value;
                }
            }
        }
    });
    output
}

/// Gradient with respect to the features, `[N, C, H, W]`, from that of the crops, `[R, C, Ph, Pw]`.
pub(crate) fn backward(crop_grad: &[f32], shape: [usize; 4], rois: &[f32], params: &RoiAlignParams) -> Vec<f32> {
    let [num_images, channels, height, width] = shape;
    let [bins_y, bins_x] = params.output_size;
    let num_bins = bins_y * bins_x;
    let bins: Vec<RoiBins> = rois
        .chunks_exact(5)
        .enumerate()
        .map(|(idx, roi)| RoiBins::new(roi, idx, num_images, [height, width], params))
        .collect();
    let mut output = vec![0.0; num_images * channels * height * width];
    let maps = SharedSlice::new(&mut output);
    let channel_blocks = channels.div_ceil(CHANNEL_BLOCK);
    for_each_unit(num_images * channel_blocks, |unit| {
        let image_idx = unit / channel_blocks;
        let first_channel = unit % channel_blocks * CHANNEL_BLOCK;
        let block = CHANNEL_BLOCK.min(channels - first_channel);
        // [H·W, CHANNEL_BLOCK]; ROIs are added in their order, whatever the threads do.
        let mut pixels = vec![[0.0_f32; CHANNEL_BLOCK]; height * width];
        for (roi_idx, bins) in bins.iter().enumerate() {
            if bins.image_idx != image_idx {
                continue;
            }
            let grad = &crop_grad[(roi_idx * channels + first_channel) * num_bins..];
            for bin_y in 0..bins_y {
                let (first_y, weights_y) = bins.y.bin(bin_y);
                for bin_x in 0..bins_x {
                    let (first_x, weights_x) = bins.x.bin(bin_x);
                    let mut grad_of_bin = [0.0; CHANNEL_BLOCK];
                    for (channel, grad_of_channel) in grad_of_bin[..block].iter_mut().enumerate() {
                        *grad_of_channel = grad[channel * num_bins + bin_y * bins_x + bin_x];
                    }
                    for (y, weight_y) in (first_y..).zip(weights_y) {
                        for (x, weight_x) in (first_x..).zip(weights_x) {
                            let pixel = &mut pixels[y * width + x];
                            add_scaled(pixel, &grad_of_bin, weight_y * weight_x);
                        }
                    }
                }
            }
        }
        let start = (image_idx * channels + first_channel) * height * width;
        // SAFETY: every unit has its own image and channels.
        let map = unsafe { maps.range(start, block * height * width) };
        for (channel, plane) in map.chunks_exact_mut(height * width).enumerate() {
            for (value, pixel) in plane.iter_mut().zip(&pixels) {
                *value = pixel[channel];
            }
        }
    });
    output
}

#[inline]
fn add_scaled(sum: &mut [f32], values: &[f32], weight: f32) {
    for (sum, value) in sum.iter_mut().zip(values) {
        *sum += weight * value;
    }
}

/// `[N, C, P]` to `[N, P, C]`.
fn channels_last(features: &[f32], num_images: usize, channels: usize, num_pixels: usize) -> Vec<f32> {
    const TILE: usize = 16;
    let mut output = vec![0.0; features.len()];
    let pixels = SharedSlice::new(&mut output);
    let tiles = num_pixels.div_ceil(TILE);
    for_each_unit(num_images, |image_idx| {
        let base = image_idx * channels * num_pixels;
        // SAFETY: every unit has its own image.
        let pixels = unsafe { pixels.range(base, channels * num_pixels) };
        let planes = &features[base..base + channels * num_pixels];
        for tile in 0..tiles {
            let range = tile * TILE..((tile + 1) * TILE).min(num_pixels);
            for channel in 0..channels {
                let plane = &planes[channel * num_pixels..(channel + 1) * num_pixels];
                for pixel in range.clone() {
                    pixels[pixel * channels + channel] = plane[pixel];
                }
            }
        }
    });
    output
}
