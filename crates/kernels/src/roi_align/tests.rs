//! Compares ROIAlign with plain loops, its composed default, values computed by hand and finite differences.

use burn::backend::Flex;
use burn::tensor::{Device, Tensor};
use proptest::prelude::*;

use super::roi_align;
use crate::composed;
use crate::flex_tensor::values;
use crate::params::{RoiAlignParams, RoiAlignment, SamplingRatio};
use crate::reference::{assert_close, random_values, roi_align_backward, roi_align_forward, to_first, to_last};

const ALIGNMENTS: [RoiAlignment; 2] = [RoiAlignment::HalfPixel, RoiAlignment::Legacy];
const RATIOS: [SamplingRatio; 3] = [SamplingRatio::Adaptive, SamplingRatio::Fixed(1), SamplingRatio::Fixed(2)];
const SHAPE: [usize; 4] = [2, 19, 7, 11];

/// An image pixel is half a feature pixel wide: the maps cover 22 × 14 image pixels.
#[rustfmt::skip]
const ROIS: [f32; 50] = [
    // Inside; a sliver; beyond the lower right and upper left corners; all of the map and more.
    0.0, 2.0, 3.0, 17.0, 11.0,
    1.0, 4.3, 1.1, 4.9, 12.7,
    1.0, 15.0, 8.0, 40.0, 30.0,
    0.0, -9.0, -7.0, 6.0, 5.0,
    0.0, -10.0, -10.0, 50.0, 50.0,
    // Completely outside; without area; with exchanged corners; long and thin; the last pixel.
    1.0, 100.0, 100.0, 120.0, 110.0,
    0.0, 6.0, 6.0, 6.0, 6.0,
    1.0, 12.0, 9.0, 5.0, 3.0,
    1.0, 0.0, 5.0, 22.0, 6.0,
    0.0, 20.0, 12.0, 22.0, 14.0,
];

fn params(output_size: [usize; 2], alignment: RoiAlignment, sampling_ratio: SamplingRatio) -> RoiAlignParams {
    RoiAlignParams { output_size, spatial_scale: 0.5, sampling_ratio, alignment }
}

/// The kernels on channels-first maps, as the plain loops use them.
fn forward(features: &[f32], shape: [usize; 4], rois: &[f32], params: &RoiAlignParams) -> Vec<f32> {
    let [bins_y, bins_x] = params.output_size;
    let crops = super::kernel::forward(&to_last(features, shape), shape, rois, params);
    to_first(&crops, [rois.len() / 5, shape[1], bins_y, bins_x])
}

fn backward(crop_grad: &[f32], shape: [usize; 4], rois: &[f32], params: &RoiAlignParams) -> Vec<f32> {
    let [bins_y, bins_x] = params.output_size;
    let crop_grad = to_last(crop_grad, [rois.len() / 5, shape[1], bins_y, bins_x]);
    to_first(&super::kernel::backward(&crop_grad, shape, rois, params), shape)
}

fn check(shape: [usize; 4], rois: &[f32], params: &RoiAlignParams) {
    let about = format!("{params:?}");
    let features = random_values(shape.iter().product(), 1);
    let expected = roi_align_forward(&features, shape, rois, params);
    let crops = forward(&features, shape, rois, params);
    assert_close(&crops, &expected, &format!("crops, {about}"));
    let crop_grad = random_values(crops.len(), 2);
    let expected = roi_align_backward(&crop_grad, shape, rois, params);
    let grad = backward(&crop_grad, shape, rois, params);
    assert_close(&grad, &expected, &format!("gradient, {about}"));
}

#[test]
fn every_mode_agrees_with_plain_loops() {
    for alignment in ALIGNMENTS {
        for ratio in RATIOS {
            for output_size in [[3, 4], [7, 7], [1, 1]] {
                check(SHAPE, &ROIS, &params(output_size, alignment, ratio));
                // A map of one pixel, one channel.
                let rois = [0.0, -1.0, -1.0, 3.0, 3.0, 0.0, 0.5, 0.5, 1.0, 1.5];
                check([1, 1, 1, 1], &rois, &params(output_size, alignment, ratio));
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 100,
        rng_seed: proptest::test_runner::RngSeed::Fixed(3),
        failure_persistence: None,
        ..ProptestConfig::default()
    })]

    #[test]
    fn random_rois_agree_with_plain_loops(
        corners in proptest::collection::vec((-10.0f32..30.0, -10.0f32..30.0, -5.0f32..40.0, -5.0f32..40.0), 1..6),
        legacy: bool,
        ratio in 0usize..4,
    ) {
        let rois: Vec<f32> = corners
            .iter()
            .flat_map(|&(x, y, width, height)| [0.0, x, y, x + width, y + height])
            .collect();
        let ratio = if ratio == 0 { SamplingRatio::Adaptive } else { SamplingRatio::Fixed(ratio) };
        check([1, 3, 7, 11], &rois, &params([3, 2], ALIGNMENTS[usize::from(legacy)], ratio));
    }
}

#[test]
fn the_composed_default_agrees() {
    let device = Device::flex();
    let features = random_values(SHAPE.iter().product(), 1);
    for alignment in ALIGNMENTS {
        for ratio in RATIOS {
            let params = params([3, 4], alignment, ratio);
            let crops = composed::roi_align::<Flex>(
                crate::flex_tensor::tensor(features.clone(), SHAPE),
                crate::flex_tensor::tensor(ROIS.to_vec(), [10, 5]),
                params,
            )
            .to_contiguous();
            let expected = forward(&features, SHAPE, &ROIS, &params);
            assert_close(values(&crops), &expected, "composed");
        }
    }
    // And its gradient, where f64 uses the default.
    let grad_of = |dtype| {
        let device = device.clone().autodiff();
        let features = Tensor::<1>::from_floats(features.as_slice(), &device).reshape(SHAPE).cast(dtype).require_grad();
        let rois = Tensor::<1>::from_floats(ROIS.as_slice(), &device).reshape([10, 5]).cast(dtype);
        let params = params([3, 4], RoiAlignment::HalfPixel, SamplingRatio::Adaptive);
        let crops = roi_align(features.clone(), rois, params);
        let grads = crops.clone().powi_scalar(2).sum().backward();
        features.grad(&grads).unwrap().cast(burn::tensor::DType::F32).into_data().try_into_vec::<f32>().unwrap()
    };
    assert_close(&grad_of(burn::tensor::DType::F32), &grad_of(burn::tensor::DType::F64), "gradient of the default");
}

#[test]
fn a_ramp_gives_the_bins_centres() {
    // feature(y, x) = x; the ROI spans feature pixels 2 to 6, so bins of 2 are centred at 3 and 5.
    let features: Vec<f32> = (0..8 * 9).map(|idx| (idx % 9) as f32).collect();
    let rois = [0.0, 4.0, 4.0, 12.0, 12.0];
    for ratio in RATIOS {
        let legacy = params([2, 2], RoiAlignment::Legacy, ratio);
        let crops = forward(&features, [1, 1, 8, 9], &rois, &legacy);
        assert_close(&crops, &[3.0, 5.0, 3.0, 5.0], "values at pixel corners");
        // With values at pixel centres, x = 3 lies between pixels 2 and 3.
        let half_pixel = params([2, 2], RoiAlignment::HalfPixel, ratio);
        let crops = forward(&features, [1, 1, 8, 9], &rois, &half_pixel);
        assert_close(&crops, &[2.5, 4.5, 2.5, 4.5], "values at pixel centres");
    }
}

#[test]
fn gradients_agree_with_finite_differences() {
    // Linear in the features: a central difference is exact except for rounding.
    const STEP: f32 = 0.5;
    const TOLERANCE: f32 = 1e-4;
    let shape = [2, 2, 4, 5];
    let rois = [0.0, 1.0, 1.0, 7.5, 6.0, 1.0, -2.0, 3.0, 4.0, 12.0];
    let params = params([2, 3], RoiAlignment::HalfPixel, SamplingRatio::Adaptive);
    let device = Device::flex().autodiff();
    let values = random_values(80, 1);
    let pattern = random_values(24, 2);
    let crops_of = |values: &[f32], device: &Device| {
        let features = Tensor::<1>::from_floats(values, device).reshape(shape).require_grad();
        let rois = Tensor::<1>::from_floats(rois, device).reshape([2, 5]);
        let pattern = Tensor::<1>::from_floats(pattern.as_slice(), device).reshape([2, 2, 2, 3]);
        let loss = (roi_align(features.clone(), rois, params) * pattern).sum();
        (features, loss)
    };
    let (features, loss) = crops_of(&values, &device);
    let grad = features.grad(&loss.backward()).unwrap();
    let grad = grad.into_data().try_into_vec::<f32>().unwrap();
    for (at, grad) in grad.iter().enumerate() {
        let moved = |step: f32| {
            let mut values = values.clone();
            values[at] += step;
            let (_, loss) = crops_of(&values, &device);
            loss.into_scalar::<f32>()
        };
        let expected = (moved(STEP) - moved(-STEP)) / (2.0 * STEP);
        assert!((grad - expected).abs() < TOLERANCE, "{at}: {grad}, {expected}");
    }
}

#[test]
fn views_and_empty_lists_of_rois() {
    let device = Device::flex();
    let params = params([2, 2], RoiAlignment::HalfPixel, SamplingRatio::Fixed(2));
    let features = Tensor::<1>::from_floats(random_values(2 * 3 * 6 * 8, 1).as_slice(), &device).reshape([2, 3, 6, 8]);
    let rois = Tensor::<1>::from_floats([0.0, 1.0, 1.0, 9.0, 8.0], &device).reshape([1, 5]);
    let turned = features.clone().swap_dims(2, 3);
    let copied = Tensor::<4>::from_data(turned.clone().into_data(), &device);
    let from_view = roi_align(turned, rois.clone().swap_dims(0, 1).swap_dims(0, 1), params);
    let from_copy = roi_align(copied, rois.clone(), params);
    from_view.into_data().assert_eq(&from_copy.into_data(), true);
    let none = roi_align(features, rois.slice([0..0, 0..5]), params);
    assert_eq!(none.dims(), [0, 3, 2, 2]);
}

#[test]
fn odd_rois_neither_hang_nor_poison() {
    let features = random_values(SHAPE.iter().product(), 1);
    let huge = [0.0, -1e30, -1e30, 1e30, 1e30, 0.0, -1e6, 0.0, 1e6, 14.0];
    let params = params([2, 2], RoiAlignment::HalfPixel, SamplingRatio::Adaptive);
    let crops = forward(&features, SHAPE, &huge, &params);
    assert!(crops.iter().all(|value| value.is_finite()));
    let unreal = [0.0, f32::NAN, 0.0, 9.0, 9.0, 1.0, 0.0, 0.0, f32::INFINITY, 9.0];
    let crops = forward(&features, SHAPE, &unreal, &params);
    assert!(crops.iter().all(|value| *value == 0.0));
    // A NaN feature appears in the bins that sample it, and in no other.
    let mut poisoned = features;
    poisoned[0] = f32::NAN;
    let rois = [0.0, 0.0, 0.0, 3.0, 3.0, 0.0, 10.0, 5.0, 20.0, 12.0];
    let crops = forward(&poisoned, SHAPE, &rois, &params);
    assert!(crops[0].is_nan());
    assert!(crops[4..].iter().all(|value| value.is_finite()));
}

#[test]
fn results_do_not_depend_on_the_number_of_threads() {
    let features = random_values(SHAPE.iter().product(), 1);
    let params = params([7, 7], RoiAlignment::HalfPixel, SamplingRatio::Adaptive);
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let crops = forward(&features, SHAPE, &ROIS, &params);
            let grad = backward(&crops, SHAPE, &ROIS, &params);
            [crops, grad].map(|values| values.iter().map(|v| v.to_bits()).collect::<Vec<_>>())
        })
    };
    let one = run(1);
    assert!(run(2) == one && run(5) == one);
}

#[test]
#[should_panic(expected = "expected an image index in 0..2 in ROI 0, found 2")]
fn an_image_that_is_not_there_is_refused() {
    let device = Device::flex();
    roi_align(
        Tensor::ones([2, 1, 4, 4], &device),
        Tensor::<1>::from_floats([2.0, 0.0, 0.0, 1.0, 1.0], &device).reshape([1, 5]),
        params([2, 2], RoiAlignment::HalfPixel, SamplingRatio::Adaptive),
    );
}
