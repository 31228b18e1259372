//! Compares the operations except `cosines` and `log_softmax`, forwards and backwards, on every device of the build
//! with `Flex`.
//!
//! Requires the features of the devices: `make test-wgpu`, `make test-ndarray`.
#![cfg(any(feature = "ndarray", feature = "wgpu", feature = "cuda"))]
#![allow(clippy::unwrap_used)]

use burn::tensor::{Device, Tensor};
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;
use sdg_kernels::{
    Activation, AdamWParams, Conv2dEpilogue, Conv2dParams, GroupNormParams, MaxPool2dParams, RoiAlignParams,
    RoiAlignment, SamplingRatio, adamw, conv_transpose2d, conv2d_fused, fully_connected, group_norm_residual,
    max_pool2d, permute_maps, roi_align, upsample_nearest_2x,
};

/// Maximum difference, relative to the largest magnitude: sums of up to a thousand products in a different order.
const RELATIVE: f32 = 2e-5;

/// Devices to compare with `Flex`.
fn devices() -> Vec<(&'static str, Device)> {
    vec![
        #[cfg(feature = "ndarray")]
        #[allow(deprecated)]
        ("ndarray", Device::ndarray()),
        #[cfg(feature = "wgpu")]
        ("wgpu", Device::wgpu(Default::default())),
        #[cfg(feature = "cuda")]
        ("cuda", Device::cuda(0)),
    ]
}

fn random<const D: usize>(shape: [usize; D], seed: u64, device: &Device) -> Tensor<D> {
    let mut rng = Pcg64Mcg::seed_from_u64(seed);
    let values: Vec<f32> = (0..shape.iter().product()).map(|_| rng.random_range(-1.0..1.0)).collect();
    Tensor::<1>::from_floats(values.as_slice(), device).reshape(shape)
}

fn values<const D: usize>(tensor: Tensor<D>) -> Vec<f32> {
    tensor.into_data().try_into_vec().unwrap()
}

/// Runs `operation` on `Flex` and on each device; asserts that the results, and the gradients of their weighted sum
/// with respect to the inputs, agree.
fn assert_agrees<const N: usize>(
    name: &str,
    inputs: [[usize; 4]; N],
    operation: impl Fn([Tensor<4>; N], &Device) -> Tensor<4>,
) {
    let run = |device: Device| -> Vec<Vec<f32>> {
        // First without autodiff, which is a different implementation.
        let plain = std::array::from_fn(|i| random(inputs[i], i as u64, &device));
        let mut results = vec![values(operation(plain, &device))];
        let tracked = device.autodiff();
        let leaves: [Tensor<4>; N] = std::array::from_fn(|i| random(inputs[i], i as u64, &tracked).require_grad());
        let output = operation(leaves.clone(), &tracked);
        let weights = random(output.dims(), 99, &tracked);
        results.push(values(output.clone().inner()));
        let gradients = (output * weights).sum().backward();
        results.extend(leaves.iter().map(|leaf| values(leaf.grad(&gradients).unwrap())));
        results
    };
    let expected = run(Device::flex());
    for (device_name, device) in devices() {
        for (part, (expected, found)) in expected.iter().zip(run(device)).enumerate() {
            assert_eq!(expected.len(), found.len());
            let scale = expected.iter().fold(0.0f32, |most, value| most.max(value.abs()));
            let difference = expected.iter().zip(&found).map(|(a, b)| (a - b).abs()).fold(0.0f32, f32::max);
            println!("{name} on {device_name}, part {part}: {:.1e}", difference / scale);
            // The fold would ignore a NaN.
            assert!(found.iter().all(|value| value.is_finite()) && scale > 0.0);
            assert!(difference <= RELATIVE * scale, "{name} on {device_name}, part {part}: {difference} of {scale}");
        }
    }
}

#[test]
fn convolutions_agree() {
    for (kernel, params, [channels_in, channels_out]) in [
        (3, Conv2dParams::square(1, 1), [24, 20]),
        // With multiples of sixteen, flex uses Winograd's transforms.
        (3, Conv2dParams::square(1, 1), [32, 16]),
        (3, Conv2dParams::square(2, 1), [24, 20]),
        (1, Conv2dParams::UNIT, [24, 20]),
        (7, Conv2dParams::square(2, 3), [24, 20]),
    ] {
        let [height, width] = output_size(params, kernel);
        let inputs =
            [[2, channels_in, 13, 17], [channels_out, channels_in, kernel, kernel], [2, channels_out, height, width]];
        for activation in [Activation::Identity, Activation::Relu] {
            let name = format!("conv2d {kernel}×{kernel} {channels_in} to {channels_out} {params:?}");
            assert_agrees(&name, inputs, |[x, weight, residual], device| {
                let (bias, scale) = (random([channels_out], 7, device), random([channels_out], 8, device));
                let epilogue = Conv2dEpilogue { scale: Some(scale), residual: Some(residual), activation };
                conv2d_fused(x, weight, Some(bias), params, epilogue)
            });
        }
    }
    let inputs = [[2, 12, 7, 9], [12, 8, 4, 4]];
    assert_agrees("conv_transpose2d", inputs, |[x, weight], device| {
        conv_transpose2d(x, weight, Some(random([8], 7, device)), Conv2dParams::square(2, 1))
    });
}

/// Output size of a convolution of a map of 13 × 17 pixels.
fn output_size(params: Conv2dParams, kernel: usize) -> [usize; 2] {
    [13, 17].map(|size| (size + 2 * params.padding[0] - kernel) / params.stride[0] + 1)
}

#[test]
fn fully_connected_layers_agree() {
    for activation in [Activation::Identity, Activation::Relu] {
        assert_agrees("fully_connected", [[3, 16, 7, 7], [20, 16 * 49, 1, 1]], |[x, weight], device| {
            let output = fully_connected(x, weight.reshape([20, 16 * 49]), random([20], 7, device), activation);
            output.reshape([3, 20, 1, 1])
        });
    }
}

#[test]
fn group_norms_agree() {
    for activation in [Activation::Identity, Activation::Relu] {
        let params = GroupNormParams { num_groups: 4, epsilon: 1e-5, activation };
        assert_agrees("group_norm", [[2, 16, 9, 11], [2, 16, 9, 11]], |[x, residual], device| {
            group_norm_residual(x, random([16], 7, device), random([16], 8, device), Some(residual), params)
        });
    }
}

#[test]
fn changes_of_resolution_and_order_agree() {
    let params = MaxPool2dParams { kernel: [3, 3], stride: [2, 2], padding: [1, 1] };
    assert_agrees("max_pool2d", [[2, 8, 13, 17]], |[x], _| max_pool2d(x, params));
    assert_agrees("upsample_nearest_2x", [[2, 8, 5, 7]], |[x], _| upsample_nearest_2x(x));
    assert_agrees("permute_maps", [[4, 3, 5, 7]], |[x], _| permute_maps(x, &[2, 0, 3, 1]));
}

#[test]
fn roi_aligns_agree_in_every_mode() {
    // Inside, over every border, outside, without area, reversed, far larger than the map.
    let rois = [
        [0.0, 1.0, 2.0, 21.0, 17.0],
        [1.0, -9.0, -7.0, 8.5, 9.5],
        [0.0, 20.0, 10.0, 90.0, 80.0],
        [1.0, 100.0, 100.0, 120.0, 130.0],
        [1.0, 5.0, 5.0, 5.0, 5.0],
        [0.0, 12.0, 11.0, 6.0, 5.0],
        [1.0, -9000.0, -9000.0, 9000.0, 9000.0],
    ];
    for alignment in [RoiAlignment::HalfPixel, RoiAlignment::Legacy] {
        for sampling_ratio in [SamplingRatio::Adaptive, SamplingRatio::Fixed(2)] {
            for output_size in [[7, 7], [3, 2]] {
                let params = RoiAlignParams { output_size, spatial_scale: 0.5, sampling_ratio, alignment };
                assert_agrees(&format!("roi_align {params:?}"), [[2, 6, 11, 14]], |[features], device| {
                    let rois = Tensor::<1>::from_floats(rois.as_flattened(), device).reshape([7, 5]);
                    roi_align(features, rois, params)
                });
            }
        }
    }
}

#[test]
fn rois_that_are_no_numbers_give_zeros() {
    let params = RoiAlignParams {
        output_size: [2, 2],
        spatial_scale: 0.5,
        sampling_ratio: SamplingRatio::Adaptive,
        alignment: RoiAlignment::HalfPixel,
    };
    let rois = [[0.0, f32::NAN, 0.0, 9.0, 9.0], [0.0, 0.0, 0.0, f32::INFINITY, 9.0], [0.0, -1e30, -1e30, 1e30, 1e30]];
    for (name, device) in devices() {
        let rois = Tensor::<1>::from_floats(rois.as_flattened(), &device).reshape([3, 5]);
        let crops = values(roi_align(random([1, 2, 8, 8], 1, &device), rois, params));
        let (unreal, huge) = crops.split_at(2 * 8);
        assert!(unreal.iter().all(|value| *value == 0.0), "{name}: {unreal:?}");
        assert!(huge.iter().all(|value| value.is_finite()), "{name}: {huge:?}");
    }
}

#[test]
fn steps_of_the_optimiser_agree() {
    let step = |device: &Device| {
        let (mut param, mut moments) = (random([6, 5], 1, device), None);
        for step in 1..=3 {
            let params = AdamWParams {
                learning_rate: 1e-2,
                beta_1: 0.9,
                beta_2: 0.999,
                epsilon: 1e-8,
                weight_decay: 0.05,
                max_norm: Some(1.0),
                step,
            };
            let (next, after) = adamw(param, random([6, 5], 1 + step as u64, device), moments, params);
            (param, moments) = (next, Some(after));
        }
        values(param)
    };
    let expected = step(&Device::flex());
    for (name, device) in devices() {
        for (expected, found) in expected.iter().zip(step(&device)) {
            assert!((expected - found).abs() < RELATIVE, "{name}: {expected}, {found}");
        }
    }
}
