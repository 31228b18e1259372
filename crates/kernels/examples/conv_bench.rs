//! Convolution forwards and backwards at training sizes: this crate's kernels compared with burn-flex's own.
//!
//! `cargo run --release -p sdg-kernels --example conv_bench`

use std::time::Instant;

use burn::tensor::module;
use burn::tensor::ops::ConvOptions;
use burn::tensor::{Device, Distribution, Tensor};
use sdg_kernels::{Conv2dParams, conv2d};

/// Seconds of the forward pass and of the backward pass: the minimum of six runs.
fn time(operation: impl Fn(Tensor<4>, Tensor<4>) -> Tensor<4>, x: [usize; 4], weight: [usize; 4]) -> [f64; 2] {
    let device = Device::flex().autodiff();
    let x = Tensor::<4>::random(x, Distribution::Default, &device).require_grad();
    let weight = Tensor::<4>::random(weight, Distribution::Default, &device).require_grad();
    let mut best = [f64::MAX; 2];
    for _ in 0..6 {
        let start = Instant::now();
        let output = operation(x.clone(), weight.clone());
        best[0] = best[0].min(start.elapsed().as_secs_f64());
        // The loss costs little compared with the convolution, and is the same for both implementations.
        let loss = output.sum();
        let start = Instant::now();
        let grads = loss.backward();
        best[1] = best[1].min(start.elapsed().as_secs_f64());
        assert!(x.grad(&grads).is_some());
    }
    best
}

fn main() {
    let cases = [
        ("3x3 64->64, 1 x 120x160", [1, 64, 120, 160], [64, 64, 3, 3], 1, 1),
        ("3x3 32->32, 4 x 60x80", [4, 32, 60, 80], [32, 32, 3, 3], 1, 1),
        ("3x3 128->128, 4 x 15x20", [4, 128, 15, 20], [128, 128, 3, 3], 1, 1),
        ("3x3 256->256, 4 x 8x10", [4, 256, 8, 10], [256, 256, 3, 3], 1, 1),
        ("3x3 128->128, 64 x 14x14", [64, 128, 14, 14], [128, 128, 3, 3], 1, 1),
        ("3x3 s2 64->128, 4 x 30x40", [4, 64, 30, 40], [128, 64, 3, 3], 2, 1),
        ("7x7 s2 3->32, 4 x 240x320", [4, 3, 240, 320], [32, 3, 7, 7], 2, 3),
        ("1x1 32->64, 4 x 60x80", [4, 32, 60, 80], [64, 32, 1, 1], 1, 0),
    ];
    println!("GFLOP/s                     | forward  ours  flex | backward  ours  flex | both: times faster");
    for (name, x, weight, stride, padding) in cases {
        let params = Conv2dParams::square(stride, padding);
        let [out_height, out_width] = params.output_size([x[2], x[3]], [weight[2], weight[3]]).expect("kernels fit");
        let products = x[0] * out_height * out_width * weight.iter().product::<usize>();
        let forward_gflop = 2e-9 * products as f64;
        let ours = time(|x, w| conv2d(x, w, None, params), x, weight);
        let flex = time(
            |x, w| {
                let options = ConvOptions::new([stride; 2], [padding; 2], [1, 1], 1);
                module::conv2d(x, w, None, options)
            },
            x,
            weight,
        );
        println!(
            "{name:<27} | {:14.0} {:5.0} | {:14.0} {:5.0} | {:8.1}",
            forward_gflop / ours[0],
            forward_gflop / flex[0],
            2.0 * forward_gflop / ours[1],
            2.0 * forward_gflop / flex[1],
            (flex[0] + flex[1]) / (ours[0] + ours[1]),
        );
    }
}
