//! Compares group normalisation with its composed default, whose gradients are burn's, and with values computed by
//! hand.

use burn::tensor::{DType, Device, Tensor};

use super::kernel::{backward, forward};
use super::{group_norm, group_norm_residual};
use crate::params::{Activation, GroupNormParams};
use crate::reference::{assert_close, random_values, to_first, to_last};
use crate::simd::Isa;

const ACTIVATIONS: [Activation; 2] = [Activation::Identity, Activation::Relu];

fn to_vec<const D: usize>(tensor: Tensor<D>) -> Vec<f32> {
    let data = tensor.cast(DType::F32).into_data();
    data.try_into_vec::<f32>().unwrap()
}

/// Output and gradients of `Σ output · pattern`; `DType::F64` takes the composed default.
fn run(shape: [usize; 4], params: GroupNormParams, added: bool, dtype: DType) -> Vec<Vec<f32>> {
    let device = Device::flex().autodiff();
    let make = |len: usize, seed: u64, offset: f32| {
        let values = Tensor::<1>::from_floats(random_values(len, seed).as_slice(), &device);
        (values + offset).cast(dtype)
    };
    let len = shape.iter().product();
    // The mean is far from 0, so that a variance computed carelessly would lose its digits.
    let x = make(len, 1, 20.0).reshape(shape).require_grad();
    let gamma = make(shape[1], 2, 1.0).require_grad();
    let beta = make(shape[1], 3, 0.0).require_grad();
    let residual = make(len, 5, 0.0).reshape(shape).require_grad();
    let summand = added.then(|| residual.clone());
    let output = group_norm_residual(x.clone(), gamma.clone(), beta.clone(), summand.clone(), params);
    let pattern = make(len, 4, 0.0).reshape(shape);
    // At the ReLU's kink rounding decides: outputs within 1e-3 of it have zero weight.
    let identity = GroupNormParams { activation: Activation::Identity, ..params };
    let before = group_norm_residual(x.clone(), gamma.clone(), beta.clone(), summand, identity).detach();
    let pattern = pattern.mask_fill(before.abs().lower_elem(1e-3), 0.0);
    let grads = (output.clone() * pattern).sum().backward();
    let mut found = vec![
        to_vec(output.inner()),
        to_vec(x.grad(&grads).unwrap()),
        to_vec(gamma.grad(&grads).unwrap()),
        to_vec(beta.grad(&grads).unwrap()),
    ];
    found.extend(residual.grad(&grads).map(to_vec));
    assert_eq!(found.len(), if added { 5 } else { 4 });
    found
}

#[test]
fn agrees_with_the_composed_default_and_its_gradients() {
    // The x-gradients divide by a deviation of 0.6 after sums around 20: f32 keeps four digits.
    const TOLERANCE: f32 = 2e-4;
    for activation in ACTIVATIONS {
        for (shape, num_groups) in [([2, 6, 5, 7], 3), ([1, 4, 1, 2], 1), ([3, 8, 9, 33], 8), ([2, 5, 40, 53], 1)] {
            let params = GroupNormParams { num_groups, epsilon: 1e-5, activation };
            for added in [false, true] {
                let found = run(shape, params, added, DType::F32);
                let expected = run(shape, params, added, DType::F64);
                let names = ["output", "x.grad", "gamma.grad", "beta.grad", "residual.grad"];
                for ((found, expected), name) in found.iter().zip(&expected).zip(names) {
                    let scale = expected.iter().fold(1.0_f32, |max, v| max.max(v.abs()));
                    for (idx, (found, expected)) in found.iter().zip(expected).enumerate() {
                        assert!(
                            (found - expected).abs() < TOLERANCE * scale,
                            "{name} {idx} of {shape:?}, {activation:?}: {found}, expected {expected}"
                        );
                    }
                }
            }
        }
    }
}

#[test]
fn gradients_agree_with_finite_differences() {
    const STEP: f32 = 1e-2;
    const TOLERANCE: f32 = 2e-3;
    let shape = [1, 4, 2, 3];
    let params = GroupNormParams { num_groups: 2, epsilon: 1e-3, activation: Activation::Identity };
    let isa = Isa::detect();
    let x = random_values(24, 1);
    let gamma = random_values(4, 2);
    let beta = random_values(4, 3);
    let pattern = random_values(24, 4);
    let (output, statistics) = forward(isa, &x, shape, &gamma, &beta, None, &params);
    let grads = backward(isa, [&pattern, &output], &x, shape, &gamma, &statistics, &params);
    let loss = |x: &[f32], gamma: &[f32], beta: &[f32]| {
        let (output, _) = forward(isa, x, shape, gamma, beta, None, &params);
        output.iter().zip(&pattern).map(|(o, p)| o * p).sum::<f32>()
    };
    let difference = |values: &[f32], at: usize, loss: &dyn Fn(&[f32]) -> f32| {
        let moved = |step: f32| {
            let mut values = values.to_vec();
            values[at] += step;
            loss(&values)
        };
        (moved(STEP) - moved(-STEP)) / (2.0 * STEP)
    };
    for (at, grad) in grads.x.iter().enumerate() {
        let expected = difference(&x, at, &|x| loss(x, &gamma, &beta));
        assert!((grad - expected).abs() < TOLERANCE, "x {at}: {grad}, {expected}");
    }
    for at in 0..4 {
        let expected = difference(&gamma, at, &|gamma| loss(&x, gamma, &beta));
        assert!((grads.gamma[at] - expected).abs() < TOLERANCE, "gamma {at}");
        let expected = difference(&beta, at, &|beta| loss(&x, &gamma, beta));
        assert!((grads.beta[at] - expected).abs() < TOLERANCE, "beta {at}");
    }
}

#[test]
fn two_values_by_hand() {
    // Mean 2, variance 1: x̂ is -1 and 1.
    let params = GroupNormParams { num_groups: 1, epsilon: 0.0, activation: Activation::Identity };
    for isa in Isa::available() {
        let (output, statistics) = forward(isa, &[1.0, 3.0], [1, 2, 1, 1], &[2.0, 5.0], &[0.5, 0.0], None, &params);
        assert_eq!(output, [-1.5, 5.0]);
        assert_eq!(statistics, [[2.0, 1.0]]);
        let relu = GroupNormParams { activation: Activation::Relu, ..params };
        let (output, _) = forward(isa, &[1.0, 3.0], [1, 2, 1, 1], &[2.0, 5.0], &[0.5, 0.0], None, &relu);
        assert_eq!(output, [0.0, 5.0]);
    }
}

#[test]
fn every_instruction_set_and_thread_count_gives_the_same_bits() {
    let shape = [2, 6, 13, 17];
    let params = GroupNormParams { num_groups: 2, epsilon: 1e-5, activation: Activation::Relu };
    let x = random_values(shape.iter().product(), 1);
    let g = random_values(x.len(), 2);
    let (gamma, beta) = (random_values(6, 3), random_values(6, 4));
    let run = |isa: Isa, threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let (output, statistics) = forward(isa, &x, shape, &gamma, &beta, Some(&g), &params);
            let grads = backward(isa, [&g, &output], &x, shape, &gamma, &statistics, &params);
            [output, grads.x, grads.gamma, grads.beta]
                .map(|values| values.iter().map(|v| v.to_bits()).collect::<Vec<_>>())
        })
    };
    let expected = run(Isa::Portable, 1);
    for isa in Isa::available() {
        for threads in [1, 3] {
            assert!(run(isa, threads) == expected, "{isa:?}, {threads} threads");
        }
    }
}

#[test]
fn not_a_number_spoils_its_group_only() {
    let params = GroupNormParams { num_groups: 2, epsilon: 1e-5, activation: Activation::Relu };
    let mut x = random_values(2 * 4 * 6, 1);
    x[0] = f32::NAN;
    let isa = Isa::detect();
    let shape = [2, 4, 2, 3];
    let (output, _) = forward(isa, &to_last(&x, shape), shape, &[1.0; 4], &[0.0; 4], None, &params);
    let output = to_first(&output, shape);
    assert!(output[..12].iter().all(|value| value.is_nan()));
    assert!(output[12..].iter().all(|value| value.is_finite()));
}

#[test]
fn views_are_read_as_what_they_show() {
    let device = Device::flex();
    let params = GroupNormParams { num_groups: 2, epsilon: 1e-5, activation: Activation::Identity };
    let view = Tensor::<1>::from_floats(random_values(2 * 4 * 5 * 3, 1).as_slice(), &device)
        .reshape([2, 4, 5, 3])
        .swap_dims(2, 3);
    let copy = Tensor::<4>::from_data(view.clone().into_data(), &device);
    let ones = Tensor::<1>::ones([4], &device);
    let zeros = Tensor::<1>::zeros([4], &device);
    let from_view = group_norm(view, ones.clone(), zeros.clone(), params);
    let from_copy = group_norm(copy, ones, zeros, params);
    assert_close(&to_vec(from_view), &to_vec(from_copy), "view");
}

#[test]
#[should_panic(expected = "divides 4 channels, found 3")]
fn groups_that_do_not_divide_the_channels_are_refused() {
    let device = Device::flex();
    let params = GroupNormParams { num_groups: 3, epsilon: 1e-5, activation: Activation::Identity };
    group_norm(Tensor::ones([1, 4, 2, 2], &device), Tensor::ones([4], &device), Tensor::zeros([4], &device), params);
}
