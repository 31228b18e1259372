//! The comparison network's task: to decide whether a demonstration and a place in a picture show the same part in the
//! same pose.
//!
//! ```text
//! picture ─ every visible part ─┬─ its demonstration, or another picture of it, in nearly its pose   same
//!                               ├─ the same in a wrong pose                                          different
//!                               ├─ its look-alike's demonstration, in the part's pose                different
//!                               └─ another part's demonstration, fitted to its box                   different
//! ```

use anyhow::Result;
use burn::tensor::{Device, Tensor, TensorData, activation};
use image::RgbImage;
use nalgebra::{Point2, Vector2};
use rand::seq::IndexedRandom;
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;
use sdg_comparison::{ComparisonConfig, ComparisonNetwork, Pyramid, Reference, View};
use sdg_geometry::{Angle, PlanarSimilarity, Polygon};
use sdg_layers::state_dict::{self, StateDict};
use sdg_part_generator::{Instance, MixedSample};
use sdg_training::step_seed;

use crate::network::pretrain_config;
use crate::pictures::{Pictures, look_alike_of};
use crate::run::{Settings, Task};

/// Minimum visible fraction of a part for which pairs are made.
const MIN_VISIBLE_SHARE: f64 = 0.6;
/// Minimum visible fraction of a part whose picture replaces the demonstration.
const WHOLE_SHARE: f64 = 0.97;
/// Probability that another picture of the part replaces the demonstration.
const OTHER_PICTURE_PROBABILITY: f64 = 0.35;
const BOX_PROBABILITY: f64 = 0.1;

/// Maximum errors of a pose that counts as correct: the shift as a fraction of the longer side of the outline's box,
/// the angle, and the logarithm of the scale.
const MAX_SHIFT: f64 = 0.1;
const MAX_TURN_DEGREES: f64 = 12.0;
const MAX_SIZE: f64 = 0.12;
/// Minimum errors of a pose that counts as wrong, in the same units.
const MIN_WRONG_SHIFT: f64 = 0.25;
const MIN_WRONG_TURN_DEGREES: f64 = 30.0;
const MIN_WRONG_SIZE: f64 = 0.35;

/// Number of angles at which another part's demonstration is tried.
const NUM_TURNS: usize = 12;

/// The comparison network of preset `edge`.
pub struct ComparisonTask {
    config: ComparisonConfig,
    pictures: Pictures,
    /// The parameters of an orientation CNN; its first stages initialise the trunk.
    trunk: StateDict,
}

/// One training example with its label.
struct Pair {
    view: View,
    /// Whether the view shows the part in the pose of the pair.
    is_same: bool,
}

impl ComparisonTask {
    /// Pictures per step; they give about ninety pairs.
    pub const BATCH_SIZE: usize = 3;

    /// Prepares the pictures of a run.
    ///
    /// # Errors
    /// Settings that the generator rejects.
    pub fn new(settings: &Settings, config: ComparisonConfig, orientation: StateDict) -> Result<Self> {
        let pictures = Pictures::new(settings.num_parts, &pretrain_config(), settings.seed)?;
        Ok(Self { config, pictures, trunk: orientation })
    }

    fn pairs(&self, settings: &Settings, step: usize) -> Vec<Pair> {
        let group = self.pictures.group(step);
        let first = (step * settings.batch_size) as u64;
        let pictures: Vec<MixedSample> = (first..first + settings.batch_size as u64)
            .into_par_iter()
            .map(|i| self.pictures.mixed_sample(&group, i))
            .collect();
        let of_picture = |(number, picture): (usize, &MixedSample)| {
            let seed = step_seed(settings.seed, step).wrapping_add(number as u64);
            let mut asked = Asked { task: self, pictures: &pictures, rng: Pcg64Mcg::seed_from_u64(seed) };
            let visible = picture.instances.iter().filter(|mixed| mixed.instance.visible_share >= MIN_VISIBLE_SHARE);
            visible.flat_map(|mixed| asked.about(&picture.image, mixed.part_idx, &mixed.instance, &group)).collect()
        };
        let pairs: Vec<Vec<Pair>> = pictures.par_iter().enumerate().map(of_picture).collect();
        pairs.into_iter().flatten().collect()
    }
}

/// The picture that is used as the demonstration, and the transform from it to the part's photo.
struct Shown {
    reference: Reference,
    photo_from_shown: PlanarSimilarity,
    length: f64,
    center: Point2<f64>,
    outline: Polygon,
}

struct Asked<'a> {
    task: &'a ComparisonTask,
    pictures: &'a [MixedSample],
    rng: Pcg64Mcg,
}

impl Asked<'_> {
    fn about(&mut self, image: &RgbImage, part_idx: usize, instance: &Instance, group: &[usize]) -> Vec<Pair> {
        let mut pairs = Vec::new();
        let Some(shown) = self.shown(part_idx, Some(image)) else { return pairs };
        let truth = instance.image_from_demonstration.compose(&shown.photo_from_shown);
        let has_turn = self.task.pictures.has_turn(part_idx);
        let pyramid = Pyramid::new(image);
        let mut ask = |shown: &Shown, pose: &PlanarSimilarity, is_same: bool| {
            pairs.push(Pair { view: shown.reference.view(&pyramid, pose), is_same });
        };
        let near = self.near(&shown, &truth, 1.0);
        ask(&shown, &near, true);
        let near = self.near(&shown, &truth, 0.5);
        ask(&shown, &near, true);
        let wrong = self.wrong(&shown, &truth, has_turn);
        ask(&shown, &wrong, false);

        let photo_from_part = |idx: usize| self.task.pictures.photo(idx).photo_from_part;
        let image_from_part = instance.image_from_demonstration.compose(&photo_from_part(part_idx));
        let look_alike = Some(look_alike_of(part_idx)).filter(|idx| *idx < self.task.pictures.num_parts());
        let of_group = group.choose(&mut self.rng).copied().filter(|idx| *idx != part_idx);
        for other_idx in look_alike.into_iter().chain(of_group) {
            let Some(other) = self.shown(other_idx, None) else { continue };
            let nominal = image_from_part.compose(&photo_from_part(other_idx).inverse());
            let is_look_alike = Some(other_idx) == look_alike && self.rng.random_bool(0.7);
            let pose = match is_look_alike {
                true => nominal.compose(&other.photo_from_shown),
                false => self.fitted(&other, &nominal, instance),
            };
            let pose = self.near(&other, &pose, 0.5);
            ask(&other, &pose, false);
        }
        pairs
    }

    /// The part's photo, or with [`OTHER_PICTURE_PROBABILITY`] another picture of the part.
    fn shown(&mut self, part_idx: usize, but_not: Option<&RgbImage>) -> Option<Shown> {
        let photo = &self.task.pictures.photo(part_idx).demonstration;
        let mut image = &photo.image;
        let mut outline = photo.annotation.outline.clone()?;
        let mut photo_from_shown = PlanarSimilarity::IDENTITY;
        if self.rng.random_bool(OTHER_PICTURE_PROBABILITY) {
            let in_pictures =
                self.pictures.iter().filter(|picture| but_not.is_none_or(|b| !std::ptr::eq(b, &picture.image)));
            let views: Vec<_> = in_pictures
                .flat_map(|picture| picture.instances.iter().map(move |mixed| (&picture.image, mixed)))
                .filter(|(_, mixed)| mixed.part_idx == part_idx && mixed.instance.visible_share >= WHOLE_SHARE)
                .filter_map(|(image, mixed)| Some((image, &mixed.instance, mixed.instance.outline()?)))
                .collect();
            if let Some((other, instance, other_outline)) = views.choose(&mut self.rng) {
                image = other;
                outline = other_outline.clone();
                photo_from_shown = instance.image_from_demonstration.inverse();
            }
        }
        let bounds = outline.bounds();
        if bounds.width() < 4.0 || bounds.height() < 4.0 {
            return None;
        }
        if self.rng.random_bool(BOX_PROBABILITY) {
            outline = Polygon::from_box(&bounds);
        }
        Some(Shown {
            reference: Reference::new(image, &outline, &self.task.config),
            photo_from_shown,
            length: bounds.width().max(bounds.height()),
            center: bounds.center(),
            outline,
        })
    }

    fn within(&mut self, most: f64) -> f64 {
        most * (2.0 * self.rng.random::<f64>() - 1.0)
    }

    /// A random pose near `pose`: its differences are at most the fraction `share` of the errors of a correct pose.
    fn near(&mut self, shown: &Shown, pose: &PlanarSimilarity, share: f64) -> PlanarSimilarity {
        let reach = share * MAX_SHIFT * shown.length;
        let shift = Vector2::new(self.within(reach), self.within(reach));
        let turn = Angle::from_degrees(self.within(share * MAX_TURN_DEGREES));
        let scale = self.within(share * MAX_SIZE).exp();
        pose.compose(&PlanarSimilarity::about(shown.center, shown.center + shift, turn, scale))
    }

    /// A random pose that counts as wrong because of its angle, its scale or its shift.
    fn wrong(&mut self, shown: &Shown, pose: &PlanarSimilarity, has_turn: bool) -> PlanarSimilarity {
        let near = self.near(shown, pose, 1.0);
        let (mut shift, mut turn, mut scale) = (Vector2::zeros(), 0.0, 1.0);
        match self.rng.random_range(0..5) {
            0 | 1 if has_turn => turn = self.rng.random_range(MIN_WRONG_TURN_DEGREES..360.0 - MIN_WRONG_TURN_DEGREES),
            2 if has_turn => turn = 180.0,
            3 => {
                let log = self.rng.random_range(MIN_WRONG_SIZE..2.0 * MIN_WRONG_SIZE);
                scale = if self.rng.random_bool(0.5) { log.exp() } else { (-log).exp() };
            }
            _ => {
                let direction = Angle::from_degrees(self.rng.random_range(0.0..360.0)).radians();
                let reach = shown.length * self.rng.random_range(MIN_WRONG_SHIFT..2.0);
                shift = reach * Vector2::new(direction.cos(), direction.sin());
            }
        }
        near.compose(&PlanarSimilarity::about(shown.center, shown.center + shift, Angle::from_degrees(turn), scale))
    }

    /// Another part's demonstration as a network would align it with `instance`: at the angle at which it fills the box
    /// best, or at a random angle.
    fn fitted(&mut self, other: &Shown, nominal: &PlanarSimilarity, instance: &Instance) -> PlanarSimilarity {
        let first: f64 = self.rng.random_range(0.0..360.0);
        let count = if self.rng.random_bool(0.7) { NUM_TURNS } else { 1 };
        let laid = (0..count).map(|k| {
            let turn = Angle::from_degrees(first + 360.0 * k as f64 / NUM_TURNS as f64);
            let turned = PlanarSimilarity::about(other.center, other.center, turn, 1.0);
            let bounds = other.outline.transformed(&turned).bounds();
            let nominal_scale = nominal.scale * other.photo_from_shown.scale;
            let scale = (instance.bbox.area() / bounds.area()).sqrt().clamp(nominal_scale / 1.35, nominal_scale * 1.35);
            let target = instance.bbox.center();
            let pose = PlanarSimilarity::about(bounds.center(), target, Angle::ZERO, scale).compose(&turned);
            (other.outline.transformed(&pose).bounds().iou(&instance.bbox), pose)
        });
        laid.max_by(|a, b| a.0.total_cmp(&b.0)).map_or(*nominal, |(_, pose)| pose)
    }
}

impl Task for ComparisonTask {
    type Network = ComparisonNetwork;

    fn network(&self, settings: &Settings, device: &Device) -> Result<ComparisonNetwork> {
        let network = self.config.init(device, settings.seed)?;
        // Only the parameters of the stages, which both networks have.
        let trunk: StateDict = self
            .trunk
            .iter()
            .filter_map(|(name, values)| Some((format!("trunk.{}", name.strip_prefix("stages.")?), values.clone())))
            .collect();
        Ok(state_dict::import(network, &trunk).0)
    }

    fn losses(
        &self,
        network: &ComparisonNetwork,
        settings: &Settings,
        step: usize,
    ) -> Result<Vec<(&'static str, Tensor<1>)>> {
        let device = network.device();
        let pairs = self.pairs(settings, step);
        let n = pairs.len();
        if n == 0 {
            return Ok(vec![("same", Tensor::zeros([1], &device))]);
        }
        let (views, is_same): (Vec<View>, Vec<bool>) = pairs.into_iter().map(|pair| (pair.view, pair.is_same)).unzip();
        let signs: Vec<f32> = is_same.into_iter().map(|is_same| if is_same { 1.0 } else { -1.0 }).collect();
        let signs = Tensor::<2>::from_data(TensorData::new(signs, [n, 1]), &device);
        let log_odds = network.forward(&views);
        Ok(vec![("same", activation::log_sigmoid(log_odds * signs).mean().neg())])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sdg_comparison::DIFFERENCES;
    use sdg_layers::state_dict::StateDict;

    #[test]
    fn pairs_are_drawn_by_their_step_and_the_same_part_differs_less() {
        let settings = Settings { batch_size: ComparisonTask::BATCH_SIZE, ..Settings::new(3, 16, 100) };
        let config = ComparisonConfig::edge();
        let task = ComparisonTask::new(&settings, config.clone(), StateDict::new()).unwrap();
        // The mean difference of the normalised colours on the part.
        let cells = config.trunk_map_px().pow(2);
        let difference = |pair: &Pair| {
            let of = |channels: std::ops::Range<usize>| {
                pair.view.differences()[channels.start * cells..channels.end * cells].iter().sum::<f32>()
            };
            of(3..DIFFERENCES - 1) / of(DIFFERENCES - 1..DIFFERENCES)
        };
        let mut means = [Vec::new(), Vec::new()];
        for step in 0..4 {
            let pairs = task.pairs(&settings, step);
            let again = task.pairs(&settings, step);
            assert_eq!(pairs.len(), again.len());
            assert!(pairs.iter().zip(&again).all(|(one, other)| one.view == other.view));
            pairs.iter().for_each(|pair| means[usize::from(pair.is_same)].push(f64::from(difference(pair))));
        }
        let [not, same] = means.map(|values| (values.len(), sdg_geometry::median(values).unwrap()));
        assert!(same.0 > 40 && not.0 > same.0, "{same:?} {not:?}");
        // Look-alikes and rotated parts differ little, and light makes the same part differ: the medians are 1.9 (same)
        // and 2.3 (different).
        assert!(same.1 < 0.92 * not.1, "{same:?} {not:?}");
    }
}
