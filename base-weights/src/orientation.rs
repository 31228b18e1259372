//! The orientation CNN's task: the angle of a part relative to another view of it, which is rotated in steps.
//!
//! ```text
//! a view of a part ─ crops in steps of 15° ─ features: one prototype per angle ─ imprint ─┐
//! other views of it ─ crops at any angle ─ features ───────────────── scores of the 24 angles ─ cross-entropy
//! ```

use std::f64::consts::TAU;

use anyhow::Result;
use burn::module::Module;
use burn::tensor::{Device, Tensor, TensorData, activation};
use image::RgbImage;
use rand::seq::SliceRandom;
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;
use sdg_demonstration::SampleObject;
use sdg_detection::imprint::ClassImprint;
use sdg_geometry::Angle;
use sdg_grasp::NUM_KEYPOINTS;
use sdg_layers::initialization::Initializer;
use sdg_orientation::{OrientationCnn, OrientationConfig, crop_batch};
use sdg_part_generator::Instance;
use sdg_training::orientation::{BoxJitter, LabelledCrop, OrientationTraining};
use sdg_training::step_seed;

use crate::pictures::{MIN_VISIBLE_SHARE, Pictures};
use crate::run::{Settings, Task};

/// Number of rotated crops of the one view.
const NUM_TURNS: usize = 24;
/// Maximum number of parts in a step.
const MAX_PARTS: usize = 4;
/// Maximum number of other views of a part in a step.
const MAX_VIEWS: usize = 4;

/// Standard deviation of the target distribution over the [`NUM_TURNS`] angles, around the true angle.
const SIGMA_DEGREES: f64 = 8.0;

/// The orientation CNN and its imprint network.
#[derive(Module, Debug)]
pub struct OrientationNetwork {
    /// The network, whose classes are not used.
    pub network: OrientationCnn,
    /// Computes classes from features.
    pub imprint: ClassImprint,
}

/// The orientation CNN of preset `edge`.
pub struct OrientationTask {
    config: OrientationConfig,
    pictures: Pictures,
    jitter: BoxJitter,
}

/// The crops of a part in a step: one view at all angles (`turned`), and other views at one angle each
/// (`asked`).
struct Compared {
    turned: Vec<LabelledCrop>,
    asked: Vec<LabelledCrop>,
}

impl OrientationTask {
    /// Prepares the pictures of a run.
    ///
    /// # Errors
    /// Settings that the generator rejects.
    pub fn new(settings: &Settings, config: OrientationConfig) -> Result<Self> {
        let detector = crate::network::pretrain_config();
        let pictures = Pictures::new(settings.num_parts, &detector, settings.seed)?;
        Ok(Self { config, pictures, jitter: OrientationTraining::edge(settings.seed).crops.jitter })
    }

    fn compared(&self, settings: &Settings, step: usize) -> Vec<Compared> {
        let mut group = self.pictures.group(step);
        group.retain(|part| self.pictures.has_turn(*part));
        group.truncate(MAX_PARTS);
        if group.is_empty() {
            return Vec::new();
        }
        let first = (step * settings.batch_size) as u64;
        let pictures: Vec<_> = (first..first + settings.batch_size as u64)
            .into_par_iter()
            .map(|i| self.pictures.mixed_sample(&group, i))
            .collect();
        let compared = |(place, part): (usize, &usize)| {
            let seed = step_seed(settings.seed, step).wrapping_add(place as u64);
            let mut rng = Pcg64Mcg::seed_from_u64(seed);
            let mut views: Vec<(&RgbImage, SampleObject)> = pictures
                .iter()
                .flat_map(|picture| picture.instances.iter().map(move |mixed| (&picture.image, mixed)))
                .filter(|(_, mixed)| mixed.part_idx == *part)
                .filter_map(|(image, mixed)| Some((image, object(&mixed.instance, image)?)))
                .collect();
            views.shuffle(&mut rng);
            let ((image, object), others) = views.split_first()?;
            let start: f64 = rng.random_range(0.0..360.0);
            let mut crop = |image: &RgbImage, object: &SampleObject, degrees: f64, jitter: &BoxJitter| {
                let turn = Angle::from_degrees(degrees);
                LabelledCrop::of(object, image, turn, jitter, self.config.input_px, &mut rng)
            };
            let turned: Vec<LabelledCrop> = (0..NUM_TURNS)
                .filter_map(|k| crop(image, object, start + 360.0 * k as f64 / NUM_TURNS as f64, &BoxJitter::NONE))
                .collect();
            let asked: Vec<LabelledCrop> = others
                .iter()
                .take(MAX_VIEWS)
                .enumerate()
                // Each view is rotated by the golden angle further than the one before: the angles are spread
                // evenly without random numbers.
                .filter_map(|(k, (image, object))| crop(image, object, start + 137.5 * (k + 1) as f64, &self.jitter))
                .collect();
            (turned.len() == NUM_TURNS && !asked.is_empty()).then_some(Compared { turned, asked })
        };
        group.par_iter().enumerate().filter_map(compared).collect()
    }
}

impl Task for OrientationTask {
    type Network = OrientationNetwork;

    fn network(&self, settings: &Settings, device: &Device) -> Result<OrientationNetwork> {
        let network = self.config.init(device, settings.seed)?;
        let mut init = Initializer::new(device, settings.seed ^ 0x6f72_6965);
        Ok(OrientationNetwork { network, imprint: ClassImprint::init(self.config.hidden, &mut init) })
    }

    fn losses(
        &self,
        network: &OrientationNetwork,
        settings: &Settings,
        step: usize,
    ) -> Result<Vec<(&'static str, Tensor<1>)>> {
        let device = network.network.device();
        let compared = self.compared(settings, step);
        let crops: Vec<&LabelledCrop> = compared.iter().flat_map(|one| one.turned.iter().chain(&one.asked)).collect();
        if crops.is_empty() {
            return Ok(vec![("turn", Tensor::zeros([1], &device))]);
        }
        let images: Vec<RgbImage> = crops.iter().map(|one| one.crop.clone()).collect();
        let features = network.network.features(crop_batch(&images, &device));
        let (mut sum, mut count) = (Tensor::zeros([1], &device), 0);
        let mut start = 0;
        for Compared { turned, asked } in &compared {
            let prototypes = features.clone().narrow(0, start, NUM_TURNS);
            let of_asked = features.clone().narrow(0, start + NUM_TURNS, asked.len());
            start += NUM_TURNS + asked.len();
            let (weights, biases) = network.imprint.classifier(prototypes);
            let scores = of_asked.matmul(weights.transpose()) + biases.unsqueeze();
            let targets: Vec<f32> = asked.iter().flat_map(|one| bell(one.angle, turned)).collect();
            let targets = Tensor::<2>::from_data(TensorData::new(targets, [asked.len(), NUM_TURNS]), &device);
            sum = sum - (targets * activation::log_softmax(scores, 1)).sum();
            count += asked.len();
        }
        Ok(vec![("turn", sum / count as f64)])
    }
}

/// The target distribution over rotated crops, around an angle; its sum is one.
fn bell(angle: Angle, turned: &[LabelledCrop]) -> Vec<f32> {
    let concentration = (360.0 / (TAU * SIGMA_DEGREES)).powi(2);
    let weights: Vec<f64> =
        turned.iter().map(|one| (concentration * (Angle::distance(angle, one.angle).cos() - 1.0)).exp()).collect();
    let sum: f64 = weights.iter().sum();
    weights.into_iter().map(|weight| (weight / sum) as f32).collect()
}

/// The ground truth of an instance in the form that crops are made from; `None` if the instance is hardly
/// visible or has no outline.
fn object(instance: &Instance, image: &RgbImage) -> Option<SampleObject> {
    let bbox = instance.bbox.clip(f64::from(image.width()), f64::from(image.height()));
    if instance.visible_share < MIN_VISIBLE_SHARE || bbox.width() < 4.0 || bbox.height() < 4.0 {
        return None;
    }
    Some(SampleObject {
        keypoints: instance.grasp.keypoints(NUM_KEYPOINTS),
        outline: Some(instance.outline()?),
        image_from_demonstration: instance.image_from_demonstration,
        demonstration_idx: 0,
        bbox,
    })
}
