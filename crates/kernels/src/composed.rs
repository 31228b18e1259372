//! The operations as compositions of burn's own tensor operations, on any backend.
//!
//! They are the default bodies of [`KernelBackend`](crate::KernelBackend), and the reference of the
//! kernels' tests. They are correct and differentiable, but not optimised for speed.

use burn::backend::ops::{ConvOptions, ConvTransposeOptions};
use burn::backend::tensor::FloatTensor;
use burn::backend::{Backend, TensorMetadata, read_sync};
use burn::tensor::{Shape, Slice, TensorData};

use crate::params::AdamWParams;
use crate::params::CosineParams;
use crate::params::RoiAlignParams;
use crate::params::{Activation, FusedGroupNormParams};
use crate::params::{Conv2dParams, FusedConv2dParams};
use crate::roi_bins::RoiBins;

/// [`conv2d_fused`](crate::conv2d_fused) by burn's `conv2d`.
pub fn conv2d<B: Backend>(
    x: FloatTensor<B>,
    weight: FloatTensor<B>,
    bias: FloatTensor<B>,
    scale: FloatTensor<B>,
    residual: FloatTensor<B>,
    params: FusedConv2dParams,
) -> FloatTensor<B> {
    let FusedConv2dParams { conv, scaled, added, activation } = params;
    let channels = weight.shape()[0];
    let per_channel = |values| B::float_reshape(values, Shape::from(vec![1, channels, 1, 1]));
    let options = ConvOptions::new(conv.stride, conv.padding, [1, 1], 1);
    let mut output = B::conv2d(x, weight, None, options);
    if scaled {
        output = B::float_mul(output, per_channel(scale));
    }
    output = B::float_add(output, per_channel(bias));
    if added {
        output = B::float_add(output, residual);
    }
    activated::<B>(output, activation)
}

fn activated<B: Backend>(x: FloatTensor<B>, activation: Activation) -> FloatTensor<B> {
    match activation {
        Activation::Identity => x,
        Activation::Relu => B::relu(x),
    }
}

/// [`conv_transpose2d`](crate::conv_transpose2d) by burn's `conv_transpose2d`.
pub fn conv_transpose2d<B: Backend>(
    x: FloatTensor<B>,
    weight: FloatTensor<B>,
    bias: FloatTensor<B>,
    params: Conv2dParams,
) -> FloatTensor<B> {
    let options = ConvTransposeOptions::new(params.stride, params.padding, [0, 0], [1, 1], 1);
    B::conv_transpose2d(x, weight, Some(bias), options)
}

fn scaled<B: Backend>(tensor: FloatTensor<B>, factor: f32) -> FloatTensor<B> {
    B::float_mul_scalar(tensor, factor.into())
}

fn row<B: Backend>(tensor: FloatTensor<B>, idx: isize) -> FloatTensor<B> {
    B::float_slice(tensor, &[Slice::new(idx, Some(idx + 1), 1), Slice::full()])
}

/// Reshapes a tensor to `[1, count]`.
fn in_a_row<B: Backend>(tensor: FloatTensor<B>) -> FloatTensor<B> {
    let count = tensor.shape().num_elements();
    B::float_reshape(tensor, Shape::from(vec![1, count]))
}

/// The moments of [`adamw`](crate::adamw()), term by term.
pub fn adamw_moments<B: Backend>(grad: FloatTensor<B>, moments: FloatTensor<B>, params: AdamWParams) -> FloatTensor<B> {
    let grad = in_a_row::<B>(grad);
    let grad = match params.max_norm {
        None => grad,
        Some(most) => {
            let squares = B::float_mul(grad.clone(), grad.clone());
            let norm = B::float_reshape(B::float_sqrt(B::float_sum(squares)), Shape::from(vec![1, 1]));
            let factor = scaled::<B>(B::float_recip(B::float_add_scalar(norm, f32::MIN_POSITIVE.into())), most);
            B::float_mul(grad, B::float_clamp_max(factor, 1.0_f32.into()))
        }
    };
    let square = B::float_mul(grad.clone(), grad.clone());
    let mean = |idx, beta: f32, news| {
        B::float_add(scaled::<B>(row::<B>(moments.clone(), idx), beta), scaled::<B>(news, 1.0 - beta))
    };
    B::float_cat(vec![mean(0, params.beta_1, grad), mean(1, params.beta_2, square)], 0)
}

/// The value of [`adamw`](crate::adamw()), term by term.
pub fn adamw_value<B: Backend>(param: FloatTensor<B>, moments: FloatTensor<B>, params: AdamWParams) -> FloatTensor<B> {
    let param = in_a_row::<B>(param);
    let [first_correction, second_correction] = params.corrections();
    let first = scaled::<B>(row::<B>(moments.clone(), 0), 1.0 / first_correction);
    let root = B::float_sqrt(scaled::<B>(row::<B>(moments, 1), 1.0 / second_correction));
    let delta = B::float_div(first, B::float_add_scalar(root, params.epsilon.into()));
    let kept = scaled::<B>(param, 1.0 - params.learning_rate * params.weight_decay);
    B::float_sub(kept, scaled::<B>(delta, params.learning_rate))
}

/// [`fully_connected`](crate::fully_connected()) by burn's product of matrices.
pub fn fully_connected<B: Backend>(
    x: FloatTensor<B>,
    weight: FloatTensor<B>,
    bias: FloatTensor<B>,
    activation: Activation,
) -> FloatTensor<B> {
    let [num_maps, features, inputs] = [x.shape()[0], weight.shape()[0], weight.shape()[1]];
    let x = B::float_reshape(x, Shape::from([num_maps, inputs]));
    let products = B::float_matmul(x, B::float_swap_dims(weight, 0, 1));
    activated::<B>(B::float_add(products, B::float_reshape(bias, Shape::from([1, features]))), activation)
}

/// [`permute_maps`](crate::permute_maps) by burn's `select`.
pub fn permute_maps<B: Backend>(x: FloatTensor<B>, order: &[usize]) -> FloatTensor<B> {
    let indices: Vec<i32> = order.iter().map(|&map| map as i32).collect();
    let device = x.device();
    let count = indices.len();
    B::float_select(x, 0, B::int_from_data(TensorData::new(indices, [count]), &device))
}

/// [`roi_align`](crate::roi_align()) by two matrix products per image, one per axis.
///
/// Needs `R·C·Ph·W` floats at a time, with R the maximum number of ROIs of one image.
pub fn roi_align<B: Backend>(features: FloatTensor<B>, rois: FloatTensor<B>, params: RoiAlignParams) -> FloatTensor<B> {
    let shape = features.shape();
    let [num_images, channels, height, width] = [shape[0], shape[1], shape[2], shape[3]];
    let [bins_y, bins_x] = params.output_size;
    let device = features.device();
    let dtype = features.dtype();
    let rois = read_sync(B::float_into_data(rois))
        .expect("roi_align: the ROIs can be read back from the device")
        .convert::<f32>()
        .try_into_vec::<f32>()
        .expect("roi_align: converted to f32 above");
    let bins: Vec<RoiBins> = rois
        .chunks_exact(5)
        .enumerate()
        .map(|(idx, roi)| RoiBins::new(roi, idx, num_images, [height, width], &params))
        .collect();

    let from_vec = |values: Vec<f32>, shape: Vec<usize>| {
        B::float_from_data(TensorData::new(values, shape).convert_dtype(dtype), &device)
    };
    let mut crops = Vec::new();
    let mut row_of_roi = vec![0; bins.len()];
    let mut rows_done = 0;
    for image_idx in 0..num_images {
        let of_image: Vec<usize> = (0..bins.len()).filter(|&roi| bins[roi].image_idx == image_idx).collect();
        if of_image.is_empty() {
            continue;
        }
        let num_rois = of_image.len();
        let mut weights_y = vec![0.0; num_rois * bins_y * height];
        let mut weights_x = vec![0.0; num_rois * bins_x * width];
        for (slot, &roi) in of_image.iter().enumerate() {
            row_of_roi[roi] = rows_done + slot;
            let y = slot * bins_y * height;
            let x = slot * bins_x * width;
            bins[roi].y.write_dense(&mut weights_y[y..y + bins_y * height], height);
            bins[roi].x.write_dense(&mut weights_x[x..x + bins_x * width], width);
        }
        rows_done += num_rois;

        let image = B::float_slice(features.clone(), &[Slice::from(image_idx..image_idx + 1)]);
        // [C, H, W] -> [H, C·W]
        let image = B::float_reshape(image, Shape::from(vec![channels, height, width]));
        let image = B::float_permute(image, &[1, 0, 2]);
        let image = B::float_reshape(image, Shape::from(vec![height, channels * width]));
        // [R·Ph, H] x [H, C·W] -> [R, Ph·C, W]
        let rows = B::float_matmul(from_vec(weights_y, vec![num_rois * bins_y, height]), image);
        let rows = B::float_reshape(rows, Shape::from(vec![num_rois, bins_y * channels, width]));
        // [R, Ph·C, W] x [R, W, Pw] -> [R, C, Ph, Pw]
        let columns = B::float_swap_dims(from_vec(weights_x, vec![num_rois, bins_x, width]), 1, 2);
        let crop = B::float_matmul(rows, columns);
        let crop = B::float_reshape(crop, Shape::from(vec![num_rois, bins_y, channels, bins_x]));
        crops.push(B::float_permute(crop, &[0, 2, 1, 3]));
    }
    let crops = B::float_cat(crops, 0);
    // From the order of images back to that of the ROIs; in 32 bits, because graphics cards may have no wider integers.
    let order: Vec<i32> = row_of_roi.iter().map(|&row| row as i32).collect();
    let order = TensorData::new(order, [bins.len()]);
    B::float_select(crops, 0, B::int_from_data(order, &device))
}

/// [`group_norm_residual`](crate::group_norm_residual) by means over a reshaped tensor.
pub fn group_norm<B: Backend>(
    x: FloatTensor<B>,
    gamma: FloatTensor<B>,
    beta: FloatTensor<B>,
    residual: FloatTensor<B>,
    params: FusedGroupNormParams,
) -> FloatTensor<B> {
    let FusedGroupNormParams { norm: params, added } = params;
    let shape = x.shape();
    let [num_images, channels] = [shape[0], shape[1]];
    let values = channels / params.num_groups * shape[2] * shape[3];
    let grouped = Shape::from(vec![num_images, params.num_groups, values]);
    let x = B::float_reshape(x, grouped);
    let x = B::float_sub(x.clone(), B::float_mean_dim(x, 2));
    let variance = B::float_mean_dim(B::float_mul(x.clone(), x.clone()), 2);
    let deviation = B::float_sqrt(B::float_add_scalar(variance, params.epsilon.into()));
    let x = B::float_reshape(B::float_div(x, deviation), shape);
    let per_channel = |values| B::float_reshape(values, Shape::from(vec![1, channels, 1, 1]));
    let x = B::float_mul(x, per_channel(gamma));
    let x = B::float_add(x, per_channel(beta));
    let x = if added { B::float_add(x, residual) } else { x };
    activated::<B>(x, params.activation)
}

/// [`upsample_nearest_2x`](crate::upsample_nearest_2x) by repeating along two new axes.
pub fn upsample_nearest_2x<B: Backend>(x: FloatTensor<B>) -> FloatTensor<B> {
    let shape = x.shape();
    let [n, c, h, w] = [shape[0], shape[1], shape[2], shape[3]];
    let x = B::float_reshape(x, Shape::from(vec![n, c, h, 1, w, 1]));
    let x = B::float_expand(x, Shape::from(vec![n, c, h, 2, w, 2]));
    B::float_reshape(x, Shape::from(vec![n, c, 2 * h, 2 * w]))
}

/// [`cosines`](crate::cosines()) by a product of the two maps for every relative shift.
pub fn cosines<B: Backend>(one: FloatTensor<B>, other: FloatTensor<B>, params: CosineParams) -> FloatTensor<B> {
    let CosineParams { reach, epsilon } = params;
    let shape = one.shape();
    let [num_images, channels, height, width] = [shape[0], shape[1], shape[2], shape[3]];
    let unit = |map: FloatTensor<B>| {
        let squares = B::float_sum_dim(B::float_mul(map.clone(), map.clone()), 1);
        B::float_div(map, B::float_sqrt(B::float_add_scalar(squares, epsilon.into())))
    };
    let (one, other) = (unit(one), unit(other));
    let all = [Slice::from(0..num_images), Slice::from(0..channels)];
    let at = |y: usize, x: usize| [all[0], all[1], Slice::from(y..y + height), Slice::from(x..x + width)];
    let (device, dtype) = (one.device(), one.dtype());
    let padded = Shape::from(vec![num_images, channels, height + 2 * reach, width + 2 * reach]);
    let zeros = B::float_zeros(padded, &device, dtype.into());
    let other = B::float_slice_assign(zeros, &at(reach, reach), other);
    let shifts = (0..=2 * reach).flat_map(|dy| (0..=2 * reach).map(move |dx| (dy, dx)));
    let cosines = shifts
        .map(|(dy, dx)| {
            let shifted = B::float_slice(other.clone(), &at(dy, dx));
            B::float_sum_dim(B::float_mul(one.clone(), shifted), 1)
        })
        .collect();
    B::float_cat(cosines, 1)
}
