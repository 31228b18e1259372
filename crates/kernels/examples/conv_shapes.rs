//! Times of an R50-FPN backbone at 480×640: each convolution alone, forwards, with packed weights. The FPN's
//! convolutions at p4 and p5 are left out.
//!
//! `cargo run --release -p sdg-kernels --example conv_shapes`

use std::time::Instant;

use burn::tensor::{Device, Distribution, Tensor};
use sdg_kernels::{Conv2dParams, conv2d};

/// Name, count, channels in and out, input map, kernel, stride.
type Case = (&'static str, usize, [usize; 2], [usize; 2], usize, usize);

fn main() {
    let cases: [Case; 27] = [
        ("stem 7x7 s2", 1, [3, 64], [480, 640], 7, 2),
        ("res2 1x1 64->64", 1, [64, 64], [120, 160], 1, 1),
        ("res2 1x1 256->64", 2, [256, 64], [120, 160], 1, 1),
        ("res2 3x3", 3, [64, 64], [120, 160], 3, 1),
        ("res2 1x1 64->256", 4, [64, 256], [120, 160], 1, 1),
        ("res3 1x1 256->128", 1, [256, 128], [120, 160], 1, 1),
        ("res3 3x3 s2", 1, [128, 128], [120, 160], 3, 2),
        ("res3 short", 1, [256, 512], [120, 160], 1, 2),
        ("res3 1x1 512->128", 3, [512, 128], [60, 80], 1, 1),
        ("res3 3x3", 3, [128, 128], [60, 80], 3, 1),
        ("res3 1x1 128->512", 4, [128, 512], [60, 80], 1, 1),
        ("res4 1x1 512->256", 1, [512, 256], [60, 80], 1, 1),
        ("res4 3x3 s2", 1, [256, 256], [60, 80], 3, 2),
        ("res4 short", 1, [512, 1024], [60, 80], 1, 2),
        ("res4 1x1 1024->256", 5, [1024, 256], [30, 40], 1, 1),
        ("res4 3x3", 5, [256, 256], [30, 40], 3, 1),
        ("res4 1x1 256->1024", 6, [256, 1024], [30, 40], 1, 1),
        ("res5 1x1 1024->512", 1, [1024, 512], [30, 40], 1, 1),
        ("res5 3x3 s2", 1, [512, 512], [30, 40], 3, 2),
        ("res5 short", 1, [1024, 2048], [30, 40], 1, 2),
        ("res5 1x1 2048->512", 2, [2048, 512], [15, 20], 1, 1),
        ("res5 3x3", 2, [512, 512], [15, 20], 3, 1),
        ("res5 1x1 512->2048", 3, [512, 2048], [15, 20], 1, 1),
        ("fpn lateral p2", 1, [256, 256], [120, 160], 1, 1),
        ("fpn lateral p3", 1, [512, 256], [60, 80], 1, 1),
        ("fpn output p2", 1, [256, 256], [120, 160], 3, 1),
        ("fpn output p3", 1, [256, 256], [60, 80], 3, 1),
    ];
    let device = Device::flex();
    println!("convolution          | each ms | GFLOP/s | all of its kind ms");
    let (mut all_ms, mut all_gflop) = (0.0, 0.0);
    for (name, count, [channels_in, channels_out], [height, width], kernel, stride) in cases {
        let x = Tensor::<4>::random([1, channels_in, height, width], Distribution::Default, &device);
        // The input comes from a convolution, so that it has the memory layout of the backbone's own maps.
        let eye = Tensor::<2>::eye(channels_in, &device).reshape([channels_in, channels_in, 1, 1]);
        let x = conv2d(x, eye, None, Conv2dParams::square(1, 0));
        let shape = [channels_out, channels_in, kernel, kernel];
        let weight = Tensor::<4>::random(shape, Distribution::Default, &device);
        let params = Conv2dParams::square(stride, kernel / 2);
        let mut seconds: Vec<f64> = (0..15)
            .map(|_| {
                let start = Instant::now();
                std::hint::black_box(conv2d(x.clone(), weight.clone(), None, params));
                start.elapsed().as_secs_f64()
            })
            .collect();
        seconds.sort_by(f64::total_cmp);
        let median = seconds[seconds.len() / 2];
        let [out_height, out_width] = params.output_size([height, width], [kernel; 2]).expect("kernels fit");
        let gflop = 2e-9 * (out_height * out_width * shape.iter().product::<usize>()) as f64;
        all_ms += 1e3 * median * count as f64;
        all_gflop += gflop * count as f64;
        let of_kind = 1e3 * median * count as f64;
        println!("{name:<20} | {:7.2} | {:7.0} | {of_kind:6.1}", 1e3 * median, gflop / median);
    }
    println!("all {all_ms:.0} ms, {all_gflop:.1} GFLOP");
}
