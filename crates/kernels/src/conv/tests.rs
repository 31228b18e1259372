//! Compares the functions on tensors with burn's own convolution and its gradients, and with finite differences.

use burn::tensor::module;
use burn::tensor::ops::{ConvOptions, ConvTransposeOptions};
use burn::tensor::{DType, Device, Tensor};

use super::{Conv2dEpilogue, Conv2dParams, conv_transpose2d, conv2d, conv2d_fused};
use crate::reference::{assert_close, random_values};

fn tensor<const D: usize>(shape: [usize; D], seed: u64, device: &Device) -> Tensor<D> {
    let values = random_values(shape.iter().product(), seed);
    Tensor::<1>::from_floats(values.as_slice(), device).reshape(shape)
}

fn to_vec<const D: usize>(tensor: Tensor<D>) -> Vec<f32> {
    tensor.into_data().try_into_vec::<f32>().unwrap()
}

/// Output and gradients with respect to x, weight and bias of `Σ output · pattern`.
fn run(
    operation: impl Fn(Tensor<4>, Tensor<4>, Tensor<1>) -> Tensor<4>,
    x: [usize; 4],
    weight: [usize; 4],
    out_channels: usize,
) -> [Vec<f32>; 4] {
    let device = Device::flex().autodiff();
    let x = tensor(x, 1, &device).require_grad();
    let weight = tensor(weight, 2, &device).require_grad();
    let bias = tensor([out_channels], 3, &device).require_grad();
    let output = operation(x.clone(), weight.clone(), bias.clone());
    let pattern = tensor(output.dims(), 4, &device);
    let grads = (output.clone() * pattern).sum().backward();
    [
        to_vec(output.inner()),
        to_vec(x.grad(&grads).unwrap()),
        to_vec(weight.grad(&grads).unwrap()),
        to_vec(bias.grad(&grads).unwrap()),
    ]
}

fn assert_all_close(found: &[Vec<f32>; 4], expected: &[Vec<f32>; 4]) {
    let names = ["output", "x.grad", "weight.grad", "bias.grad"];
    for ((found, expected), name) in found.iter().zip(expected).zip(names) {
        assert_close(found, expected, name);
    }
}

#[test]
fn conv2d_agrees_with_burn_and_its_gradients() {
    let cases = [
        ([2, 3, 9, 11], [4, 3, 3, 3], [1, 1], [1, 1]),
        ([1, 3, 17, 20], [5, 3, 7, 7], [2, 2], [3, 3]),
        ([2, 8, 6, 7], [9, 8, 1, 1], [2, 2], [0, 0]),
        ([1, 2, 5, 8], [3, 2, 2, 3], [2, 1], [0, 2]),
    ];
    for (x, weight, stride, padding) in cases {
        let params = Conv2dParams { stride, padding };
        let ours = |x, w, b| conv2d(x, w, Some(b), params);
        let burns = |x, w, b| module::conv2d(x, w, Some(b), ConvOptions::new(stride, padding, [1, 1], 1));
        let out_channels = weight[0];
        assert_all_close(&run(ours, x, weight, out_channels), &run(burns, x, weight, out_channels));
    }
}

#[test]
fn conv_transpose2d_agrees_with_burn_and_its_gradients() {
    let cases = [
        // The kernels of the keypoint head and the mask head, and one at stride 1.
        ([2, 6, 7, 7], [6, 5, 4, 4], [2, 2], [1, 1]),
        ([3, 4, 5, 6], [4, 7, 2, 2], [2, 2], [0, 0]),
        ([1, 3, 4, 5], [3, 2, 3, 3], [1, 1], [1, 1]),
        // A stride larger than the kernel leaves pixels that only the bias reaches.
        ([1, 3, 4, 5], [3, 2, 2, 1], [3, 2], [0, 0]),
    ];
    for (x, weight, stride, padding) in cases {
        let params = Conv2dParams { stride, padding };
        let ours = |x, w, b| conv_transpose2d(x, w, Some(b), params);
        let burns = |x, w, b| {
            let options = ConvTransposeOptions::new(stride, padding, [0, 0], [1, 1], 1);
            module::conv_transpose2d(x, w, Some(b), options)
        };
        let out_channels = weight[1];
        assert_all_close(&run(ours, x, weight, out_channels), &run(burns, x, weight, out_channels));
    }
}

#[test]
fn gradients_agree_with_finite_differences() {
    // The operations are linear in each operand, so that a central difference is exact except for rounding.
    const STEP: f32 = 0.5;
    const TOLERANCE: f32 = 1e-4;
    let params = Conv2dParams::square(2, 1);
    type Operation = fn(Tensor<4>, Tensor<4>, Tensor<1>, Conv2dParams) -> Tensor<4>;
    let operations: [(Operation, [usize; 4], [usize; 4]); 2] = [
        (|x, w, b, p| conv2d(x, w, Some(b), p), [1, 2, 5, 4], [3, 2, 3, 3]),
        (|x, w, b, p| conv_transpose2d(x, w, Some(b), p), [1, 2, 3, 4], [2, 3, 4, 4]),
    ];
    for (operation, x_shape, weight_shape) in operations {
        let [_, x_grad, weight_grad, bias_grad] = run(|x, w, b| operation(x, w, b, params), x_shape, weight_shape, 3);
        let device = Device::flex();
        let x = random_values(x_shape.iter().product(), 1);
        let weight = random_values(weight_shape.iter().product(), 2);
        let bias = random_values(3, 3);
        let loss = |x: &[f32], weight: &[f32], bias: &[f32]| {
            let make = |values: &[f32]| Tensor::<1>::from_floats(values, &device);
            let x = make(x).reshape(x_shape);
            let weight = make(weight).reshape(weight_shape);
            let output = operation(x, weight, make(bias), params);
            let pattern = tensor(output.dims(), 4, &device);
            (output * pattern).sum().into_scalar::<f32>()
        };
        let difference = |values: &[f32], at: usize, loss: &dyn Fn(&[f32]) -> f32| {
            let moved = |step: f32| {
                let mut values = values.to_vec();
                values[at] += step;
                loss(&values)
            };
            (moved(STEP) - moved(-STEP)) / (2.0 * STEP)
        };
        for (at, grad) in x_grad.iter().enumerate() {
            let expected = difference(&x, at, &|x| loss(x, &weight, &bias));
            assert!((grad - expected).abs() < TOLERANCE, "x {at}: {grad} {expected}");
        }
        for (at, grad) in weight_grad.iter().enumerate() {
            let expected = difference(&weight, at, &|weight| loss(&x, weight, &bias));
            assert!((grad - expected).abs() < TOLERANCE, "weight {at}: {grad} {expected}");
        }
        for (at, grad) in bias_grad.iter().enumerate() {
            let expected = difference(&bias, at, &|bias| loss(&x, &weight, bias));
            assert!((grad - expected).abs() < TOLERANCE, "bias {at}: {grad} {expected}");
        }
    }
}

#[test]
fn transposed_and_sliced_tensors_are_read_as_what_they_show() {
    let params = Conv2dParams::square(1, 1);
    let options = || ConvOptions::new([1, 1], [1, 1], [1, 1], 1);
    let views = |x: Tensor<4>, w: Tensor<4>| {
        let x = x.swap_dims(2, 3).slice([0..2, 1..4, 0..6, 2..9]);
        let w = w.swap_dims(0, 1).slice([0..4, 0..3, 0..3, 0..3]);
        (x, w)
    };
    // The output is also transposed, so that the incoming gradient is not a contiguous tensor.
    let ours = |x, w, b| {
        let (x, w) = views(x, w);
        conv2d(x, w, Some(b), params).swap_dims(2, 3)
    };
    let burns = |x, w, b| {
        let (x, w) = views(x, w);
        module::conv2d(x, w, Some(b), options()).swap_dims(2, 3)
    };
    let (x, weight) = ([2, 5, 10, 8], [3, 4, 3, 3]);
    assert_all_close(&run(ours, x, weight, 4), &run(burns, x, weight, 4));
}

/// Output and gradients of `Σ output · pattern` of a convolution with all its epilogue or, with `in_steps`, of the
/// same computation by separate operations.
fn run_fused(x: [usize; 4], weight: [usize; 4], params: Conv2dParams, in_steps: bool) -> Vec<Vec<f32>> {
    let device = Device::flex().autodiff();
    let channels = weight[0];
    let x = tensor(x, 1, &device).require_grad();
    let weight = tensor(weight, 2, &device).require_grad();
    let bias = tensor([channels], 3, &device).require_grad();
    let scale: Tensor<1> = tensor([channels], 4, &device);
    let plain = conv2d(x.clone(), weight.clone(), None, params);
    let residual = tensor(plain.dims(), 5, &device).require_grad();
    let per_channel = |vector: Tensor<1>| vector.reshape([1, channels, 1, 1]);
    let before = plain * per_channel(scale.clone()) + per_channel(bias.clone()) + residual.clone();
    // At the ReLU's kink rounding decides: outputs within 1e-3 of it have zero weight.
    let pattern = tensor(before.dims(), 6, &device).mask_fill(before.clone().detach().abs().lower_elem(1e-3), 0.0);
    let output = if in_steps {
        burn::tensor::activation::relu(before)
    } else {
        let epilogue = Conv2dEpilogue {
            scale: Some(scale),
            residual: Some(residual.clone()),
            activation: crate::Activation::Relu,
        };
        conv2d_fused(x.clone(), weight.clone(), Some(bias.clone()), params, epilogue)
    };
    let grads = (output.clone() * pattern).sum().backward();
    vec![
        to_vec(output.inner()),
        to_vec(x.grad(&grads).unwrap()),
        to_vec(weight.grad(&grads).unwrap()),
        to_vec(bias.grad(&grads).unwrap()),
        to_vec(residual.grad(&grads).unwrap()),
    ]
}

#[test]
fn a_fused_convolution_has_the_gradients_of_its_steps() {
    // By Winograd's method, directly in one piece, and directly with a stride.
    for (x, weight, stride, padding) in
        [([2, 16, 9, 10], [32, 16, 3, 3], 1, 1), ([2, 5, 6, 7], [9, 5, 1, 1], 1, 0), ([1, 5, 9, 8], [9, 5, 3, 3], 2, 1)]
    {
        let params = Conv2dParams::square(stride, padding);
        let found = run_fused(x, weight, params, false);
        let expected = run_fused(x, weight, params, true);
        let names = ["output", "x.grad", "weight.grad", "bias.grad", "residual.grad"];
        for ((found, expected), name) in found.iter().zip(&expected).zip(names) {
            assert_close(found, expected, &format!("{name}, {weight:?}"));
        }
    }
}

#[test]
fn packed_weights_are_forgotten_with_the_weights() {
    let device = Device::flex();
    let x = tensor([1, 16, 6, 6], 1, &device);
    let params = Conv2dParams::square(1, 1);
    // The same weights twice, then doubled (possibly in place), and then new ones, possibly at the same address.
    for seed in 2..6 {
        let mut weight: Tensor<4> = tensor([16, 16, 3, 3], seed, &device);
        let first = to_vec(conv2d(x.clone(), weight.clone(), None, params));
        assert_eq!(to_vec(conv2d(x.clone(), weight.clone(), None, params)), first);
        weight = weight * 2.0;
        let doubled: Vec<f32> = first.iter().map(|value| 2.0 * value).collect();
        assert_close(&to_vec(conv2d(x.clone(), weight, None, params)), &doubled, "doubled");
    }
}

#[test]
fn only_tracked_operands_get_gradients() {
    let device = Device::flex().autodiff();
    let image = tensor([1, 2, 6, 6], 1, &device);
    let weight = tensor([3, 2, 3, 3], 2, &device).require_grad();
    let frozen = tensor([3, 3, 3, 3], 3, &device);
    let params = Conv2dParams::square(1, 1);
    // The image and the second weight are not tracked.
    let hidden = conv2d(image.clone(), weight.clone(), None, params);
    let output = conv2d(hidden, frozen.clone(), None, params);
    let grads = output.sum().backward();
    assert!(weight.grad(&grads).is_some());
    assert!(image.grad(&grads).is_none());
    assert!(frozen.grad(&grads).is_none());
}

#[test]
fn weights_that_learn_take_images_from_the_plain_device() {
    let params = Conv2dParams::square(1, 1);
    let image = tensor([1, 2, 6, 6], 1, &Device::flex());
    let weight = tensor([3, 2, 3, 3], 2, &Device::flex().autodiff()).require_grad();
    let output = conv2d(image.clone(), weight.clone(), None, params);
    let plain = conv2d(image, weight.clone().inner(), None, params);
    assert_eq!(to_vec(output.clone().inner()), to_vec(plain));
    assert!(weight.grad(&output.sum().backward()).is_some());
}

#[test]
fn other_float_types_take_the_composed_default() {
    let device = Device::flex();
    let params = Conv2dParams::square(1, 1);
    let x = tensor([1, 2, 5, 5], 1, &device);
    let weight = tensor([2, 2, 3, 3], 2, &device);
    let wide = conv2d(x.clone().cast(DType::F64), weight.clone().cast(DType::F64), None, params);
    assert_eq!(wide.dtype(), DType::F64);
    let narrow = to_vec(conv2d(x, weight, None, params));
    assert_close(&narrow, &to_vec(wide.cast(DType::F32)), "f64");
}

#[test]
fn a_blur_by_hand() {
    let device = Device::flex();
    let x = Tensor::<4>::from_floats([[[[1.0, 2.0], [3.0, 4.0]]]], &device);
    let ones = Tensor::<4>::ones([1, 1, 3, 3], &device);
    let bias = Tensor::<1>::from_floats([0.5], &device);
    let output = conv2d(x.clone(), ones, Some(bias), Conv2dParams::square(1, 1));
    assert_eq!(to_vec(output), [10.5; 4]);
    // Each pixel becomes a 2 × 2 patch of weights times its value.
    let patch = Tensor::<4>::from_floats([[[[1.0, 10.0], [100.0, 0.0]]]], &device);
    let output = conv_transpose2d(x, patch, None, Conv2dParams::square(2, 0));
    let expected = [[1.0, 10.0, 2.0, 20.0], [100.0, 0.0, 200.0, 0.0], [3.0, 30.0, 4.0, 40.0], [300.0, 0.0, 400.0, 0.0]];
    assert_eq!(to_vec(output), expected.concat());
}

#[test]
#[should_panic(expected = "expected a weight of [Co, 3, Kh, Kw]")]
fn a_weight_for_other_channels_is_refused() {
    let device = Device::flex();
    conv2d(Tensor::ones([1, 3, 4, 4], &device), Tensor::ones([2, 4, 3, 3], &device), None, Conv2dParams::UNIT);
}

#[test]
#[should_panic(expected = "expected a padded input of at least the kernel's 5 x 5")]
fn a_kernel_larger_than_the_input_is_refused() {
    let device = Device::flex();
    conv2d(Tensor::ones([1, 3, 4, 4], &device), Tensor::ones([2, 3, 5, 5], &device), None, Conv2dParams::UNIT);
}

#[test]
#[should_panic(expected = "expected a bias of [2]")]
fn a_bias_of_another_length_is_refused() {
    let device = Device::flex();
    conv2d(
        Tensor::ones([1, 3, 4, 4], &device),
        Tensor::ones([2, 3, 3, 3], &device),
        Some(Tensor::ones([3], &device)),
        Conv2dParams::UNIT,
    );
}

#[test]
#[should_panic(expected = "expected strides of at least 1")]
fn a_stride_of_zero_is_refused() {
    let device = Device::flex();
    conv2d(Tensor::ones([1, 3, 4, 4], &device), Tensor::ones([2, 3, 3, 3], &device), None, Conv2dParams::square(0, 0));
}

/// Maps and a leaf that several operations read, once through our operations and once through burn's.
#[test]
fn gradients_of_what_is_read_more_than_once_are_added() {
    let device = Device::flex().autodiff();
    let random = |shape: [usize; 4]| tensor(shape, (shape[0] * shape[2]) as u64, &device).require_grad();
    let image = random([2, 3, 9, 10]);
    let weights = [random([4, 3, 3, 3]), random([4, 4, 3, 3]), random([4, 4, 1, 1])];
    let gradients = |ours: bool| {
        let conv = |x: Tensor<4>, weight: &Tensor<4>| {
            let padding = weight.dims()[2] / 2;
            if ours {
                return conv2d(x, weight.clone(), None, Conv2dParams::square(1, padding));
            }
            module::conv2d(x, weight.clone(), None, ConvOptions::new([1, 1], [padding; 2], [1, 1], 1))
        };
        let map = conv(image.clone(), &weights[0]);
        let loss = conv(map.clone(), &weights[1]).square().sum()
            + conv(map.clone(), &weights[2]).exp().sum()
            // An operation of burn itself that reads the same map as ours.
            + (map * 3.0).sum()
            + conv(image.clone() * 0.5, &weights[0]).square().sum()
            + conv(image.clone(), &weights[0]).exp().sum();
        let grads = loss.backward();
        let of = |tensor: &Tensor<4>| tensor.grad(&grads).unwrap();
        [of(&image), of(&weights[0]), of(&weights[1]), of(&weights[2])]
    };
    for (ours, theirs) in gradients(true).into_iter().zip(gradients(false)) {
        let largest: f32 = theirs.clone().abs().max().into_scalar();
        let error: f32 = (ours - theirs).abs().max().into_scalar();
        assert!(error < 2e-5 * largest, "{error} of {largest}");
    }
}
