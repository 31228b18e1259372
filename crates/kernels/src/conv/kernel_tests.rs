//! The convolution kernels against plain loops, on every instruction set that this machine has.

use proptest::prelude::*;

use super::Conv2dParams;
use super::kernel::{ConvShape, channel_sums, forward, input_gradient};
use super::weight_gradient::weight_gradient;
use crate::reference::{assert_close, conv_forward, conv_input_gradient, conv_weight_gradient, random_values};
use crate::simd::Isa;

struct ConvCase {
    x: [usize; 4],
    out_channels: usize,
    kernel: [usize; 2],
    params: Conv2dParams,
}

impl ConvCase {
    fn shape(&self) -> ConvShape {
        let [height, width] = self.kernel;
        let weight = [self.out_channels, self.x[1], height, width];
        ConvShape::forward(self.x, weight, self.params)
    }
}

fn check(case: ConvCase, seed: u64) {
    let shape = case.shape();
    let x = random_values(shape.input().iter().product(), seed);
    let weight = random_values(shape.weight().iter().product(), seed + 1);
    let bias = random_values(shape.out_channels, seed + 2);
    let output_grad = random_values(shape.output().iter().product(), seed + 3);
    let expected = conv_forward(&x, &weight, &bias, &shape);
    let expected_x = conv_input_gradient(&output_grad, &weight, &shape);
    let expected_weight = conv_weight_gradient(&x, &output_grad, &shape);
    for isa in Isa::available() {
        let about = format!("{isa:?} {shape:?}");
        let found = forward(isa, &x, &weight, Some(&bias), &shape);
        assert_close(&found, &expected, &format!("output, {about}"));
        let found = input_gradient(isa, &output_grad, &weight, None, &shape);
        assert_close(&found, &expected_x, &format!("input gradient, {about}"));
        let found = weight_gradient(isa, &x, &output_grad, &shape);
        assert_close(&found, &expected_weight, &format!("weight gradient, {about}"));
    }
}

#[test]
fn every_path_agrees_with_plain_loops() {
    // (N, Ci, H, W), (Co, Kh, Kw), stride, padding
    let cases = [
        // One pixel, one channel.
        ([1, 1, 1, 1], [1, 1, 1], [1, 1], [0, 0]),
        ([2, 3, 7, 9], [5, 3, 3], [1, 1], [1, 1]),
        // A ResNet's stem, its strided blocks and its shortcuts.
        ([1, 3, 20, 22], [6, 7, 7], [2, 2], [3, 3]),
        ([2, 4, 5, 6], [9, 3, 3], [2, 2], [1, 1]),
        ([2, 4, 5, 6], [9, 1, 1], [2, 2], [0, 0]),
        // Maps smaller than a panel, channels beyond a tile.
        ([3, 17, 7, 7], [33, 3, 3], [1, 1], [1, 1]),
        ([40, 16, 3, 3], [16, 3, 3], [1, 1], [1, 1]),
        // Padding larger than the map, so that whole output rows see only zeros.
        ([1, 2, 2, 2], [3, 3, 3], [1, 1], [4, 5]),
        // Kernels of the heads' transposed convolutions.
        ([2, 5, 14, 14], [8, 4, 4], [2, 2], [1, 1]),
        ([2, 5, 14, 14], [8, 2, 2], [2, 2], [0, 0]),
        // Read in place: 1 × 1, and 3 × 3 without padding.
        ([2, 64, 12, 50], [16, 1, 1], [1, 1], [0, 0]),
        ([2, 6, 9, 60], [10, 3, 3], [1, 1], [0, 0]),
        // Unequal strides, kernels, and a stride beyond the kernel, which leaves pixels unseen.
        ([2, 3, 6, 5], [3, 2, 3], [3, 2], [0, 2]),
        ([1, 3, 4, 130], [20, 3, 5], [1, 3], [2, 0]),
        ([1, 3, 5, 5], [2, 1, 1], [3, 3], [1, 1]),
        ([1, 2, 3, 3], [3, 1, 2], [4, 4], [0, 0]),
        // Several units of work and several blocks of K.
        ([1, 24, 40, 70], [8, 3, 3], [1, 1], [1, 1]),
        ([3, 9, 30, 41], [11, 3, 3], [1, 1], [1, 1]),
    ];
    for (seed, (x, [out_channels, kernel_height, kernel_width], stride, padding)) in cases.into_iter().enumerate() {
        let case = ConvCase {
            x,
            out_channels,
            kernel: [kernel_height, kernel_width],
            params: Conv2dParams { stride, padding },
        };
        check(case, 10 * seed as u64);
    }
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 60,
        rng_seed: proptest::test_runner::RngSeed::Fixed(1),
        failure_persistence: None,
        ..ProptestConfig::default()
    })]

    #[test]
    fn random_shapes_agree_with_plain_loops(
        x in [1usize..4, 1usize..11, 1usize..16, 1usize..24],
        out_channels in 1usize..20,
        kernel in [1usize..5, 1usize..5],
        stride in [1usize..4, 1usize..4],
        padding in [0usize..4, 0usize..4],
    ) {
        let params = Conv2dParams { stride, padding };
        prop_assume!(params.output_size([x[2], x[3]], kernel).is_some());
        check(ConvCase { x, out_channels, kernel, params }, 7);
    }
}

#[test]
fn results_do_not_depend_on_the_number_of_threads() {
    let isa = Isa::detect();
    // Large maps, and small maps whose filters are shared out.
    for x in [[2, 12, 50, 70], [3, 40, 6, 5]] {
        for stride in [1, 2] {
            let case = ConvCase { x, out_channels: 36, kernel: [3, 3], params: Conv2dParams::square(stride, 1) };
            let shape = case.shape();
            let x = random_values(shape.input().iter().product(), 1);
            let weight = random_values(shape.weight().iter().product(), 2);
            let grad = random_values(shape.output().iter().product(), 3);
            let run = |threads: usize| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
                let all = pool.install(|| {
                    [
                        forward(isa, &x, &weight, None, &shape),
                        input_gradient(isa, &grad, &weight, None, &shape),
                        weight_gradient(isa, &x, &grad, &shape),
                        channel_sums(&grad, shape.num_images, shape.out_channels),
                    ]
                });
                all.map(|values| values.iter().map(|v| v.to_bits()).collect::<Vec<_>>())
            };
            let one = run(1);
            for threads in [2, 3, 7] {
                assert!(run(threads) == one, "{threads} threads, {shape:?}");
            }
        }
    }
}

#[test]
fn nan_and_infinity_reach_what_they_touch_and_nothing_else() {
    let case = ConvCase { x: [1, 2, 6, 60], out_channels: 3, kernel: [3, 3], params: Conv2dParams::square(1, 1) };
    let shape = case.shape();
    let mut x = random_values(720, 1);
    // Channel 0, y 2, x 50; channel 1, y 5, x 0.
    x[2 * 60 + 50] = f32::NAN;
    x[360 + 5 * 60] = f32::INFINITY;
    let weight = random_values(54, 2);
    for isa in Isa::available() {
        let output = forward(isa, &x, &weight, None, &shape);
        for (idx, value) in output.iter().enumerate() {
            let (y, x) = (idx % 360 / 60, idx % 60);
            let near_nan = (1..=3).contains(&y) && (49..=51).contains(&x);
            let near_infinity = y >= 4 && x <= 1;
            assert_eq!(value.is_nan(), near_nan, "{isa:?}: {value} at {y}, {x}");
            assert_eq!(value.is_infinite(), near_infinity, "{isa:?}: {value} at {y}, {x}");
        }
        let grad = weight_gradient(isa, &x, &vec![1.0; 1080], &shape);
        // Every cell of channel 0 passes over the NaN. The infinity stands in the corner below on the left,
        // which only the cells of kernel rows 1, 2 and columns 0, 1 reach.
        assert!(grad[..9].iter().all(|value| value.is_nan()));
        for (cell, value) in grad[9..18].iter().enumerate() {
            let reaches = cell / 3 >= 1 && cell % 3 <= 1;
            assert_eq!(*value == f32::INFINITY, reaches, "{isa:?}: cell {cell}");
            assert_eq!(value.is_finite(), !reaches, "{isa:?}: cell {cell}");
        }
    }
}

#[test]
fn channel_sums_by_hand() {
    // Two images, two channels, three pixels.
    let values = [1.0, 2.0, 3.0, 10.0, 20.0, 30.0, 4.0, 5.0, 6.0, 40.0, 50.0, 60.0];
    assert_eq!(channel_sums(&values, 2, 2), [21.0, 210.0]);
    let long = random_values(2 * 3 * 101, 5);
    let shape_of = |channel: usize| {
        (0..2).flat_map(|image| &long[(image * 3 + channel) * 101..][..101]).map(|&v| f64::from(v)).sum::<f64>() as f32
    };
    assert_close(&channel_sums(&long, 2, 3), &[shape_of(0), shape_of(1), shape_of(2)], "channel sums");
}

#[test]
fn a_shape_knows_its_transpose() {
    let params = Conv2dParams::square(2, 1);
    let transposed = ConvShape::transposed([3, 8, 14, 14], [8, 5, 4, 4], params);
    assert_eq!(transposed.input(), [3, 5, 28, 28]);
    assert_eq!(transposed, ConvShape::forward([3, 5, 28, 28], [8, 5, 4, 4], params));
}
