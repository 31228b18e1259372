//! The works of R50-FPN: the backbone, complete detectors, training steps.

use std::path::Path;

use anyhow::{Context, Result};
use burn::optim::decay::WeightDecayConfig;
use burn::optim::momentum::MomentumConfig;
use burn::optim::{GradientsParams, ModuleOptimizer, SgdConfig};
use burn::tensor::{Device, Tensor, TensorData};
use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;
use sdg_detection::ResizedTarget;
use sdg_detection::image_transform::pad_batch;
use sdg_detection::roi_heads::roi::RoiClass;
use sdg_detection::rpn::Mode;
use sdg_detection::{GeneralizedRcnn, Target, TransformedImage};

use crate::network::{NUM_KEYPOINTS, Network};
use crate::protocol::{Facts, Work};
use crate::scene;
use crate::works::facts::{facts, mean};

/// Columns and rows of parts in a picture.
const GRID: (u32, u32) = (8, 4);
const BATCH: u32 = 2;
/// Detectron2's solver, with a learning rate that hardly changes the weights, so the hundredth step does
/// the same work as the first.
const LEARNING_RATE: f64 = 1e-5;
const MOMENTUM: f64 = 0.9;
const WEIGHT_DECAY: f32 = 1e-4;

/// Images as a batch on a device.
fn batch(images: &[TransformedImage], device: &Device) -> Tensor<4> {
    let padded = pad_batch(images, 32);
    Tensor::from_data(TensorData::new(padded.pixels, padded.dims), device)
}

pub fn backbone(weights: &Path) -> Result<Work> {
    let device = Device::flex();
    let network = Network::Faster.load(&device, weights)?;
    let images = batch(&[network.image_transform().apply(&scene::picture(0))?], &device);
    let levels = network.backbone.forward(images.clone());
    let mut level_facts = Facts::new();
    for (idx, level) in levels.into_iter().enumerate() {
        level_facts.insert(format!("p{}", idx + 2), f64::from(level.abs().mean().into_scalar::<f32>()));
    }
    Ok(Work::new(level_facts, move || {
        std::hint::black_box(network.backbone.forward(images.clone()));
        Ok(())
    }))
}

pub fn inference(network: Network, weights: &Path) -> Result<Work> {
    let detector = network.load(&Device::flex(), weights)?;
    let (transform, picture) = (detector.image_transform(), scene::picture(0));
    let found = detector.detect(&[transform.apply(&picture)?]).pop().context("one image gives one answer")?;
    let mut detection_facts =
        facts([("boxes", found.boxes.len() as f64), ("mean_score", mean(found.scores.iter().copied()))]);
    if network == Network::Keypoint {
        let scores = found.keypoints.iter().flatten().map(|keypoint| keypoint.score);
        detection_facts.insert("mean_keypoint_score".to_owned(), mean(scores));
    }
    if network == Network::Mask {
        let pixels = f64::from(scene::WIDTH * scene::HEIGHT);
        detection_facts
            .insert("mask_share".to_owned(), mean(found.masks.iter().map(|mask| mask.area() as f64 / pixels)));
    }
    Ok(Work::new(detection_facts, move || {
        std::hint::black_box(detector.detect(&[transform.apply(&picture)?]));
        Ok(())
    }))
}

pub fn training_step(network: Network, weights: &Path) -> Result<Work> {
    let mut detector = network.load(&Device::flex().autodiff(), weights)?;
    let transform = detector.image_transform();
    let target = scene::target(GRID.0, GRID.1, NUM_KEYPOINTS);
    let pictures: Vec<_> = (0..BATCH).map(scene::picture).collect();
    let transformed = move || -> Result<Vec<TransformedImage>> {
        Ok(pictures.iter().map(|picture| transform.apply(picture)).collect::<sdg_detection::Result<_>>()?)
    };
    let mut counts = sampled(&detector, &transformed()?, &target);
    if network == Network::Faster {
        counts.remove("head_rois");
    }
    let mut optimizer: ModuleOptimizer = SgdConfig::new()
        .with_momentum(Some(MomentumConfig::new().with_momentum(MOMENTUM).with_dampening(0.0)))
        .with_weight_decay(Some(WeightDecayConfig::new(WEIGHT_DECAY)))
        .init();
    let targets = vec![target; BATCH as usize];
    let mut seed = 0;
    Ok(Work::new(counts, move || {
        seed += 1;
        let losses = detector.losses(&transformed()?, &targets, seed)?;
        let gradients = GradientsParams::from_grads(losses.total().backward(), &detector);
        detector = optimizer.step(LEARNING_RATE, detector.clone(), gradients);
        Ok(())
    }))
}

/// Number of proposals that go through the box head, and through the second head.
pub fn sampled(detector: &GeneralizedRcnn, images: &[TransformedImage], target: &Target) -> Facts {
    let tensor = batch(images, &detector.device());
    let [_, _, height, width] = tensor.dims();
    let sizes: Vec<_> = images.iter().map(|image| [image.height, image.width]).collect();
    let features = detector.backbone.forward(tensor);
    let predictions = detector.proposal_generator.predict(&features, [height, width]);
    let proposals = detector.proposal_generator.propose(&predictions, &sizes, Mode::Train);
    let resized: Vec<_> = images.iter().map(|image| resized(image, target)).collect();
    let mut rngs: Vec<_> = images.iter().map(|_| Pcg64Mcg::seed_from_u64(1)).collect();
    let rois = detector.roi_heads.sample_rois(&proposals, &resized, &mut rngs);
    let positive = rois.iter().filter(|roi| matches!(roi.class, RoiClass::Object { .. })).count();
    facts([("rois", rois.len() as f64), ("head_rois", positive as f64)])
}

/// The boxes of a target, in pixels of the resized image, and its labels; the sampler uses nothing else.
fn resized(image: &TransformedImage, target: &Target) -> ResizedTarget {
    ResizedTarget {
        boxes: target.boxes.iter().map(|of_part| image.resized_box(of_part)).collect(),
        labels: target.labels.clone(),
        ..ResizedTarget::default()
    }
}
