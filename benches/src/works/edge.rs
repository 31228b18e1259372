//! The works of the `edge` preset: detection up to a grasp, and a training step.

use std::path::Path;

use anyhow::{Context, Result};
use burn::optim::GradientsParams;
use burn::tensor::Device;
use nalgebra::Point2;
use sdg_detection::{Detections, TransformedImage};
use sdg_geometry::{Keypoint, PlanarGrasp};
use sdg_training::AdamW;

use crate::network::Network;
use crate::protocol::{Facts, Work};
use crate::scene;
use crate::works::facts::{facts, mean};
use crate::works::r50::sampled;

/// Columns and rows of parts in a picture: more parts than go through the keypoint head, so that the head's work is the
/// same on both sides.
const GRID: (u32, u32) = (3, 2);
const BATCH: u32 = 4;
/// So low that the weights hardly change and the hundredth step does the same work as the first.
const LEARNING_RATE: f64 = 1e-5;
/// As in `sdg-training`.
const WEIGHT_DECAY: f64 = 1e-4;
const MAX_GRADIENT_NORM: f64 = 10.0;

/// Centre and angle of the line through each detection's keypoints.
fn grasps(found: &Detections) -> Vec<Option<PlanarGrasp>> {
    let visible = |keypoint: &sdg_detection::ScoredKeypoint| Keypoint::visible(Point2::new(keypoint.x, keypoint.y));
    found
        .keypoints
        .iter()
        .map(|list| PlanarGrasp::from_keypoints(&list.iter().map(visible).collect::<Vec<_>>(), 1.0))
        .collect()
}

pub fn detection(weights: &Path) -> Result<Work> {
    let detector = Network::Edge.load(&Device::flex(), weights)?;
    let (transform, picture) = (detector.image_transform(), scene::picture(0));
    let found = detector.detect(&[transform.apply(&picture)?]).pop().context("one image gives one answer")?;
    let keypoint_scores = found.keypoints.iter().flatten().map(|keypoint| keypoint.score);
    let detection_facts = facts([
        ("boxes", found.boxes.len() as f64),
        ("mean_score", mean(found.scores.iter().copied())),
        ("mean_keypoint_score", mean(keypoint_scores)),
    ]);
    Ok(Work::new(detection_facts, move || {
        let found = detector.detect(&[transform.apply(&picture)?]);
        std::hint::black_box(found.iter().map(grasps).collect::<Vec<_>>());
        Ok(())
    }))
}

pub fn training_step(weights: &Path) -> Result<Work> {
    let mut detector = Network::Edge.load(&Device::flex().autodiff(), weights)?;
    let transform = detector.image_transform();
    let target = scene::target(GRID.0, GRID.1, sdg_grasp::NUM_KEYPOINTS);
    // Prepared beforehand, because the trainer gets them from another thread.
    let images: Vec<TransformedImage> =
        (0..BATCH).map(|number| transform.apply(&scene::picture(number))).collect::<sdg_detection::Result<_>>()?;
    let counts = keypoint_rois(sampled(&detector, &images, &target));
    let mut optimizer = AdamW::new(WEIGHT_DECAY, MAX_GRADIENT_NORM);
    let targets = vec![target; BATCH as usize];
    let mut seed = 0;
    Ok(Work::new(counts, move || {
        seed += 1;
        let losses = detector.losses(&images, &targets, seed)?;
        let gradients = GradientsParams::from_grads(losses.total().backward(), &detector);
        detector = optimizer.step(LEARNING_RATE, detector.clone(), gradients);
        Ok(())
    }))
}

/// Limits the positive ROIs to the number that the preset sends through the keypoint head.
fn keypoint_rois(mut counts: Facts) -> Facts {
    let head = Network::Edge.config().roi_heads.keypoint_head;
    if let (Some(most), Some(count)) =
        (head.and_then(|head| head.max_train_rois_per_image), counts.get_mut("head_rois"))
    {
        *count = count.min((most * BATCH as usize) as f64);
    }
    counts
}
