//! Times of a forward pass and a training step of the `edge` preset, part by part.
//!
//! Usage: `cargo run --release -p sdg-detection --features training --example profile --
//! [batch]`

use std::time::Instant;

use burn::module::Module;
use burn::tensor::{Device, Tensor};
use image::{Rgb, RgbImage};
use sdg_detection::rpn::Mode;
use sdg_detection::{Target, TransformedImage, presets};
use sdg_geometry::{BoundingBox, GraspLine};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let batch: usize = std::env::args().nth(1).map_or(Ok(4), |a| a.parse())?;
    let device = Device::flex().autodiff();
    let config = presets::edge(12);
    let detector = config.init(&device, 1)?;
    println!("parameters: {}", detector.num_params());
    let transform = detector.image_transform();
    let start = Instant::now();
    let mut images: Vec<TransformedImage> = Vec::new();
    for i in 0..batch as u32 {
        let image = RgbImage::from_fn(640, 480, |x, y| {
            let inside = (200..400).contains(&x) && (150..250).contains(&y);
            Rgb(if inside { [220, 40, 30] } else { [(x ^ y) as u8 / 2, (i * 20) as u8, (x / 4) as u8] })
        });
        images.push(transform.apply(&image)?);
    }
    println!("transform {:.4} s an image", start.elapsed().as_secs_f64() / batch as f64);
    let line = GraspLine::new([300.0, 160.0].into(), [300.0, 240.0].into());
    let target = Target {
        boxes: vec![BoundingBox { x1: 200.0, y1: 150.0, x2: 400.0, y2: 250.0 }],
        labels: vec![0],
        keypoints: vec![line.keypoints(12)],
        masks: Vec::new(),
    };
    let targets = vec![target; batch];

    let valid = detector.valid();
    for _ in 0..3 {
        let start = Instant::now();
        let found = valid.detect(&images[..1]);
        println!("detect, 1 image: {:.3} s, {} found", start.elapsed().as_secs_f64(), found[0].boxes.len());
    }
    // The parts of a forward pass, without autodiff.
    let inner = Device::flex();
    let x = Tensor::<4>::zeros([batch, 3, 256, 320], &inner);
    for _ in 0..2 {
        let clock = Instant::now();
        let mut last = 0.0;
        let mut lap = |name: &str| {
            let now = clock.elapsed().as_secs_f64();
            println!("  {name:<12} {:.3} s", now - last);
            last = now;
        };
        let stages = valid.backbone.bottom_up.forward(x.clone());
        lap("resnet");
        let features = valid.backbone.fpn.forward(stages);
        lap("fpn");
        let predictions = valid.proposal_generator.predict(&features, [256, 320]);
        lap("rpn head");
        let sizes = vec![[240, 320]; batch];
        let proposals = valid.proposal_generator.propose(&predictions, &sizes, Mode::Test);
        lap("proposals");
        let _ = burn::tensor::read_sync(valid.roi_heads.detect(&features, &proposals, &sizes));
        lap("roi heads");
    }
    for step in 0..5 {
        let start = Instant::now();
        let losses = detector.losses(&images, &targets, step)?;
        let total: f32 = losses.total().into_scalar();
        let forward = start.elapsed().as_secs_f64();
        let gradients = losses.total().backward();
        let all = start.elapsed().as_secs_f64();
        println!("step: forward {forward:.3} s, backward {:.3} s, all {all:.3} s, loss {total:.3}", all - forward);
        drop(gradients);
    }
    Ok(())
}
