//! Compares pooling and doubling with burn's own operations and their gradients, and with values
//! computed by hand.

use burn::tensor::module;
use burn::tensor::ops::MaxPoolOptions;
use burn::tensor::{Device, Tensor};

use super::kernel::{PoolShape, max_pool, max_pool_gradient, upsample, upsample_gradient};
use super::{MaxPool2dParams, max_pool2d, upsample_nearest_2x};
use crate::reference::{assert_close, random_values};
use crate::simd::Isa;

const STEM: MaxPool2dParams = MaxPool2dParams { kernel: [3, 3], stride: [2, 2], padding: [1, 1] };

fn to_vec<const D: usize>(tensor: Tensor<D>) -> Vec<f32> {
    tensor.into_data().try_into_vec::<f32>().unwrap()
}

/// Output, and gradient of `Σ output · pattern`.
fn run(shape: [usize; 4], operation: impl Fn(Tensor<4>) -> Tensor<4>) -> [Vec<f32>; 2] {
    let device = Device::flex().autodiff();
    let make = |shape: [usize; 4], seed| {
        let values = random_values(shape.iter().product(), seed);
        Tensor::<1>::from_floats(values.as_slice(), &device).reshape(shape)
    };
    let x = make(shape, 1).require_grad();
    let output = operation(x.clone());
    let pattern = make(output.dims(), 2);
    let grads = (output.clone() * pattern).sum().backward();
    [to_vec(output.inner()), to_vec(x.grad(&grads).unwrap())]
}

#[test]
fn max_pool_agrees_with_burn_and_its_gradient() {
    let others = [
        MaxPool2dParams { kernel: [2, 2], stride: [2, 2], padding: [0, 0] },
        MaxPool2dParams { kernel: [1, 4], stride: [3, 1], padding: [0, 2] },
    ];
    for params in [STEM].into_iter().chain(others) {
        for shape in [[2, 3, 8, 10], [1, 17, 7, 5], [1, 1, 4, 4]] {
            let MaxPool2dParams { kernel, stride, padding } = params;
            let options = MaxPoolOptions::new(kernel).with_stride(stride).with_padding(padding);
            let found = run(shape, |x| max_pool2d(x, params));
            let expected = run(shape, |x| module::max_pool2d(x, options.clone()));
            assert_eq!(found[0], expected[0], "{shape:?} {params:?}");
            assert_close(&found[1], &expected[1], &format!("gradient, {shape:?} {params:?}"));
        }
    }
}

#[test]
fn doubling_agrees_with_repetition_and_its_gradient() {
    for shape in [[2, 3, 4, 5], [1, 17, 1, 1]] {
        let [n, c, h, w] = shape;
        let repeated =
            |x: Tensor<4>| x.reshape([n, c, h, 1, w, 1]).expand([n, c, h, 2, w, 2]).reshape([n, c, 2 * h, 2 * w]);
        let found = run(shape, upsample_nearest_2x);
        let expected = run(shape, repeated);
        assert_eq!(found[0], expected[0]);
        assert_close(&found[1], &expected[1], "gradient");
    }
}

#[test]
fn the_first_of_equals_gets_the_gradient_and_a_nan_is_the_largest() {
    let shape = PoolShape::new([1, 1, 2, 4], MaxPool2dParams { kernel: [2, 2], stride: [2, 2], padding: [0, 0] });
    let x = [1.0, 3.0, -1.0, f32::NAN, 3.0, 2.0, 7.0, -2.0];
    for isa in Isa::available() {
        let output = max_pool(isa, &x, &shape);
        assert!(output[0] == 3.0 && output[1].is_nan(), "{output:?}");
        let grad = max_pool_gradient(isa, &[5.0, 6.0], &x, &output, &shape);
        assert_eq!(grad, [0.0, 5.0, 0.0, 6.0, 0.0, 0.0, 0.0, 0.0]);
    }
}

#[test]
fn every_instruction_set_and_thread_count_gives_the_same_bits() {
    let shape = [2, 19, 9, 12];
    let x = random_values(shape.iter().product(), 1);
    let pool_shape = PoolShape::new(shape, STEM);
    let run = |isa: Isa, threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let pooled = max_pool(isa, &x, &pool_shape);
            let grad = max_pool_gradient(isa, &pooled, &x, &pooled, &pool_shape);
            let wide = upsample(&x, shape);
            let back = upsample_gradient(isa, &wide, shape);
            [pooled, grad, wide, back].map(|values| values.iter().map(|v| v.to_bits()).collect::<Vec<_>>())
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
#[should_panic(expected = "padding of at most half the window")]
fn padding_that_a_window_could_vanish_in_is_refused() {
    let params = MaxPool2dParams { padding: [2, 1], ..STEM };
    max_pool2d(Tensor::ones([1, 1, 4, 4], &Device::flex()), params);
}
