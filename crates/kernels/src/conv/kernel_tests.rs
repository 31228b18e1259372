//! Compares the convolution kernels with plain loops, on every instruction set of this machine.

use proptest::prelude::*;

use super::direct::Maps;
use super::filters::Filters;
use super::kernel::convolve;
use super::panels::Direction;
use super::shape::ConvShape;
use super::weight_gradient as gradient;
use crate::elementwise::{channel_sums, channels_last, relu_gradient};
use crate::params::Conv2dParams;
use crate::product::Epilogue;
use crate::reference::{
    assert_close, conv_forward, conv_input_gradient, conv_weight_gradient, random_values, to_first, to_last,
};
use crate::simd::Isa;

/// The methods for a 3×3 convolution of stride 1.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Way {
    Any,
    Direct,
}

const WAYS: [Way; 2] = [Way::Any, Way::Direct];

/// The kernels on channels-first maps, as the plain loops use them.
fn run(
    isa: Isa,
    way: Way,
    direction: Direction,
    source: &[f32],
    weight: &[f32],
    epilogue: Epilogue<'_>,
    shape: &ConvShape,
) -> Vec<f32> {
    let [from, to] = match direction {
        Direction::Forward => [shape.input(), shape.output()],
        Direction::Backward => [shape.output(), shape.input()],
    };
    let filters = |winograd| Filters::new(isa, weight, shape, direction, winograd && way == Way::Any);
    let residual = epilogue.residual.map(|residual| to_last(residual, to));
    let epilogue = Epilogue { residual: residual.as_deref(), ..epilogue };
    to_first(&convolve(isa, direction, &to_last(source, from), &filters, epilogue, shape), to)
}

fn forward(isa: Isa, way: Way, x: &[f32], weight: &[f32], bias: Option<&[f32]>, shape: &ConvShape) -> Vec<f32> {
    let epilogue = Epilogue { bias, ..Epilogue::default() };
    run(isa, way, Direction::Forward, x, weight, epilogue, shape)
}

fn input_gradient(isa: Isa, way: Way, output_grad: &[f32], weight: &[f32], shape: &ConvShape) -> Vec<f32> {
    run(isa, way, Direction::Backward, output_grad, weight, Epilogue::default(), shape)
}

fn weight_gradient(isa: Isa, way: Way, x: &[f32], output_grad: &[f32], shape: &ConvShape) -> Vec<f32> {
    let maps = |values, [num_images, channels, height, width]: [usize; 4]| Maps {
        values,
        num_images,
        size: [height, width],
        channels,
    };
    let (x, output_grad) = (to_last(x, shape.input()), to_last(output_grad, shape.output()));
    let (x, output_grad) = (maps(&x, shape.input()), maps(&output_grad, shape.output()));
    match way {
        Way::Any => gradient::weight_gradient(isa, x, output_grad, shape),
        Way::Direct => gradient::direct_weight_gradient(isa, x, output_grad, shape),
    }
}

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
        for way in WAYS {
            let about = format!("{isa:?} {way:?} {shape:?}");
            let found = forward(isa, way, &x, &weight, Some(&bias), &shape);
            assert_close(&found, &expected, &format!("output, {about}"));
            let found = input_gradient(isa, way, &output_grad, &weight, &shape);
            assert_close(&found, &expected_x, &format!("input gradient, {about}"));
            let found = weight_gradient(isa, way, &x, &output_grad, &shape);
            assert_close(&found, &expected_weight, &format!("weight gradient, {about}"));
        }
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
        // Padding larger than the map, so that whole output rows depend only on zeros.
        ([1, 2, 2, 2], [3, 3, 3], [1, 1], [4, 5]),
        // Kernels of the heads' transposed convolutions.
        ([2, 5, 14, 14], [8, 4, 4], [2, 2], [1, 1]),
        ([2, 5, 14, 14], [8, 2, 2], [2, 2], [0, 0]),
        // Read in place: 1 × 1, and 3 × 3 without padding.
        ([2, 64, 12, 50], [16, 1, 1], [1, 1], [0, 0]),
        ([2, 6, 9, 60], [10, 3, 3], [1, 1], [0, 0]),
        // Unequal strides, kernels, and a stride larger than the kernel, which skips pixels.
        ([2, 3, 6, 5], [3, 2, 3], [3, 2], [0, 2]),
        ([1, 3, 4, 130], [20, 3, 5], [1, 3], [2, 0]),
        ([1, 3, 5, 5], [2, 1, 1], [3, 3], [1, 1]),
        ([1, 2, 3, 3], [3, 1, 2], [4, 4], [0, 0]),
        // Several units of work and several blocks of positions.
        ([1, 24, 40, 70], [8, 3, 3], [1, 1], [1, 1]),
        ([3, 9, 30, 41], [11, 3, 3], [1, 1], [1, 1]),
        // One row of positions: windows side by side, with gaps, overlapping, deeper than one block, several units of work.
        ([1, 16, 1, 35], [33, 1, 5], [1, 5], [0, 0]),
        ([1, 4, 1, 117], [9, 1, 2], [1, 5], [0, 0]),
        ([1, 16, 1, 60], [5, 1, 3], [1, 2], [0, 0]),
        ([1, 48, 1, 250], [40, 1, 50], [1, 50], [0, 0]),
        ([1, 3, 1, 900], [7, 1, 4], [1, 4], [0, 0]),
        ([2, 2100, 1, 7], [8, 1, 1], [1, 1], [0, 0]),
        // Winograd's method: whole and clipped tiles, every padding, one panel and several, many tiles and few.
        ([1, 16, 3, 3], [16, 3, 3], [1, 1], [1, 1]),
        ([2, 16, 8, 9], [48, 3, 3], [1, 1], [1, 1]),
        ([1, 48, 10, 7], [16, 3, 3], [1, 1], [0, 2]),
        ([1, 16, 5, 6], [16, 3, 3], [1, 1], [2, 0]),
        ([3, 16, 50, 45], [32, 3, 3], [1, 1], [1, 1]),
        ([1, 80, 12, 13], [96, 3, 3], [1, 1], [1, 1]),
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
    // Large maps, and small maps whose filters are divided among the threads.
    for x in [[2, 12, 50, 70], [3, 40, 6, 5], [2, 16, 70, 70], [1, 96, 9, 9]] {
        for stride in [1, 2] {
            let case = ConvCase { x, out_channels: 48, kernel: [3, 3], params: Conv2dParams::square(stride, 1) };
            let shape = case.shape();
            let x = random_values(shape.input().iter().product(), 1);
            let weight = random_values(shape.weight().iter().product(), 2);
            let grad = random_values(shape.output().iter().product(), 3);
            let run = |threads: usize| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
                let all = pool.install(|| {
                    [
                        forward(isa, Way::Any, &x, &weight, None, &shape),
                        input_gradient(isa, Way::Any, &grad, &weight, &shape),
                        weight_gradient(isa, Way::Any, &x, &grad, &shape),
                        channel_sums(isa, &grad, shape.out_channels),
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
    // Two channels are convolved directly; sixteen by Winograd's method, which must detect values that are not finite.
    for channels in [2, 16] {
        let x = [1, channels, 6, 60];
        let case = ConvCase { x, out_channels: channels, kernel: [3, 3], params: Conv2dParams::square(1, 1) };
        let shape = case.shape();
        let mut x = random_values(channels * 360, 1);
        // Channel 0, y 2, x 50; channel 1, y 5, x 0.
        x[2 * 60 + 50] = f32::NAN;
        x[360 + 5 * 60] = f32::INFINITY;
        let weight = random_values(channels * channels * 9, 2);
        for isa in Isa::available() {
            let output = forward(isa, Way::Any, &x, &weight, None, &shape);
            for (idx, value) in output.iter().enumerate() {
                let (y, x) = (idx % 360 / 60, idx % 60);
                let near_nan = (1..=3).contains(&y) && (49..=51).contains(&x);
                let near_infinity = y >= 4 && x <= 1;
                assert_eq!(value.is_nan(), near_nan, "{isa:?}: {value} at {y}, {x}");
                assert_eq!(value.is_infinite(), near_infinity, "{isa:?}: {value} at {y}, {x}");
            }
            let grad = weight_gradient(isa, Way::Any, &x, &vec![1.0; channels * 360], &shape);
            // Every cell of channel 0 passes over the NaN. The infinity is in the lower left corner, which only
            // the cells of kernel rows 1, 2 and columns 0, 1 reach.
            assert!(grad[..9].iter().all(|value| value.is_nan()));
            for (cell, value) in grad[9..18].iter().enumerate() {
                let reaches = cell / 3 >= 1 && cell % 3 <= 1;
                assert_eq!(*value == f32::INFINITY, reaches, "{isa:?}: cell {cell}");
                assert_eq!(value.is_finite(), !reaches, "{isa:?}: cell {cell}");
            }
        }
    }
}

#[test]
fn what_follows_is_done_to_every_element() {
    // The cases: direct in one piece, direct in windows, Winograd's method, and, backwards, pixels that no cell
    // reaches.
    let cases = [
        ([2, 16, 9, 10], [48, 1, 1], 1, 0),
        ([1, 3, 9, 10], [37, 3, 3], 2, 1),
        ([2, 16, 9, 10], [48, 3, 3], 1, 1),
        ([1, 4, 9, 10], [6, 2, 2], 3, 0),
    ];
    for (x, [out_channels, height, width], stride, padding) in cases {
        let case = ConvCase { x, out_channels, kernel: [height, width], params: Conv2dParams::square(stride, padding) };
        let shape = case.shape();
        let weight = random_values(shape.weight().iter().product(), 1);
        for direction in [Direction::Forward, Direction::Backward] {
            let [from, to] = match direction {
                Direction::Forward => [shape.input(), shape.output()],
                Direction::Backward => [shape.output(), shape.input()],
            };
            let source = random_values(from.iter().product(), 2);
            let residual = random_values(to.iter().product(), 3);
            let (scale, bias) = (random_values(to[1], 4), random_values(to[1], 5));
            for isa in Isa::available() {
                let plain = run(isa, Way::Direct, direction, &source, &weight, Epilogue::default(), &shape);
                let expected: Vec<f32> = plain
                    .iter()
                    .zip(&residual)
                    .enumerate()
                    .map(|(at, (value, residual))| {
                        let channel = at / (to[2] * to[3]) % to[1];
                        (value * scale[channel] + bias[channel] + residual).max(0.0)
                    })
                    .collect();
                let epilogue =
                    Epilogue { scale: Some(&scale), bias: Some(&bias), residual: Some(&residual), relu: true };
                let found = run(isa, Way::Any, direction, &source, &weight, epilogue, &shape);
                assert_close(&found, &expected, &format!("{isa:?} {direction:?} {shape:?}"));
            }
        }
    }
}

#[test]
fn a_rectified_nan_stays_one() {
    for kernel in [1, 3] {
        let params = Conv2dParams::square(1, kernel / 2);
        let shape = ConvCase { x: [1, 16, 4, 4], out_channels: 16, kernel: [kernel; 2], params }.shape();
        let mut x = vec![0.0; 256];
        x[0] = f32::NAN;
        for isa in Isa::available() {
            let epilogue = Epilogue { relu: true, ..Epilogue::default() };
            let weight = vec![1.0; 256 * kernel * kernel];
            let output = run(isa, Way::Any, Direction::Forward, &x, &weight, epilogue, &shape);
            let touched = if kernel == 1 { 1 } else { 4 };
            assert_eq!(output.iter().filter(|value| value.is_nan()).count(), 16 * touched, "{isa:?}");
        }
    }
}

#[test]
fn sums_over_positions_by_hand() {
    // Three positions, two channels.
    let values = [1.0, 10.0, 2.0, 20.0, 3.0, 30.0];
    let isa = Isa::detect();
    assert_eq!(channel_sums(isa, &values, 2), [6.0, 60.0]);
    // The ReLU cut the first channel of the second position, and the second channel of the third.
    let output = [1.0, 1.0, 0.0, 1.0, f32::NAN, -0.0];
    let (masked, sums) = relu_gradient(isa, &values, &output, 2);
    assert_eq!(masked, [1.0, 10.0, 0.0, 20.0, 3.0, 0.0]);
    assert_eq!(sums, [4.0, 30.0]);
    let long = random_values(1100 * 3, 5);
    let of_channel = |channel: usize| long.iter().skip(channel).step_by(3).map(|&v| f64::from(v)).sum::<f64>() as f32;
    assert_close(&channel_sums(isa, &long, 3), &[of_channel(0), of_channel(1), of_channel(2)], "channel sums");
}

#[test]
fn channels_go_last_and_back() {
    for shape in [[2, 3, 5, 30], [1, 17, 4, 4], [3, 64, 1, 1]] {
        let values = random_values(shape.iter().product(), 1);
        let [num_images, channels, height, width] = shape;
        let isa = Isa::detect();
        let moved = channels_last(isa, &values, num_images, channels, height * width);
        assert_eq!(moved, to_last(&values, shape));
        assert_eq!(channels_last(isa, &moved, num_images, height * width, channels), values);
    }
}

#[test]
fn a_shape_knows_its_transpose() {
    let params = Conv2dParams::square(2, 1);
    let transposed = ConvShape::transposed([3, 8, 14, 14], [8, 5, 4, 4], params);
    assert_eq!(transposed.input(), [3, 5, 28, 28]);
    assert_eq!(transposed, ConvShape::forward([3, 5, 28, 28], [8, 5, 4, 4], params));
}

/// A convolution of 32 channels, repeated as given in `SDG_COUNTED`: `vectors|portable|loops direct|any ROUNDS`.
#[test]
#[ignore = "its instructions are counted under qemu: scripts/packages/count_arm64.sh"]
fn counted() {
    let told = std::env::var("SDG_COUNTED").unwrap();
    let [lanes, way, rounds] = told.split(' ').collect::<Vec<_>>().try_into().unwrap();
    let shape = ConvShape::forward([1, 32, 16, 16], [32, 32, 3, 3], Conv2dParams { stride: [1, 1], padding: [1, 1] });
    let x = random_values(shape.input().iter().product(), 1);
    let weight = random_values(shape.weight().iter().product(), 2);
    let isa = if lanes == "vectors" { Isa::detect() } else { Isa::Portable };
    let filters = |winograd| Filters::new(isa, &weight, &shape, Direction::Forward, winograd && way == "any");
    let standing = to_last(&x, shape.input());
    for _ in 0..rounds.parse::<usize>().unwrap() {
        let found = match lanes {
            "loops" => conv_forward(&x, &weight, &[0.0; 32], &shape),
            _ => convolve(isa, Direction::Forward, &standing, &filters, Epilogue::default(), &shape),
        };
        std::hint::black_box(found);
    }
}
