//! Pictures of several parts, each labelled.

use image::RgbImage;
use rand_pcg::Pcg64Mcg;

use super::composition::{SIZE_RATIO, finish};
use super::layout::Layout;
use super::render::Rendered;
use super::sample::Instance;
use super::scenes::{CANVAS, Scenes, instance};
use super::sensor;
use crate::random::{Draw, Stream, generator};

/// Maximum number of draws for a part of the wanted size.
const MAX_DRAWS: usize = 12;

/// A picture of several parts with their poses.
#[derive(Debug, Clone, PartialEq)]
pub struct MixedSample {
    /// The picture.
    pub image: RgbImage,
    /// Every labelled part in the picture. Other objects are not in the list.
    pub instances: Vec<MixedInstance>,
}

/// A part in a [`MixedSample`].
#[derive(Debug, Clone, PartialEq)]
pub struct MixedInstance {
    /// Index of the part among the parts of [`Scenes`].
    pub part_idx: usize,
    /// The part's marks and pose in the picture.
    pub instance: Instance,
}

impl Scenes {
    /// Renders sample `index` with several parts. Their number follows
    /// [`SceneConfig::instances`](crate::SceneConfig::instances), and all have about the same size; other objects
    /// and covers are as in [`Self::sample`]. The parts are chosen at random.
    pub fn mixed_sample(&self, index: u64) -> MixedSample {
        let all: Vec<usize> = (0..self.subjects.len()).collect();
        self.mixed_sample_of(&all, index)
    }

    /// Like [`Self::mixed_sample`], with a subset of the parts, given by their indices.
    ///
    /// # Panics
    /// If `of` is empty.
    pub fn mixed_sample_of(&self, of: &[usize], index: u64) -> MixedSample {
        let mut rng = generator(self.seed, Stream::MixedSample, index);
        let first = of[rng.whole(0, of.len() - 1)];
        let (view, conditions) = self.draw_view(&self.subjects[first], &mut rng);
        let mut layout = Layout::new(&view);
        let mut part_idxs = Vec::new();
        let wanted = rng.whole(self.config.instances[0], self.config.instances[1]);
        for number in 0..wanted {
            let part_idx = if number == 0 { first } else { self.draw_of_size(of, first, &mut rng) };
            if layout.lay(&self.subjects[part_idx].part, self.config.min_inside_share as f32, &mut rng) {
                part_idxs.push(part_idx);
            }
        }
        let num_instances = part_idxs.len();
        let _kinds = self.place_others(&self.subjects[first], &mut layout, num_instances, &mut rng);
        let bodies = layout.bodies;
        let scene = finish(view, bodies, conditions.glare, &mut rng);
        let sensor = self.sensor(&conditions, &mut rng);
        let (Rendered { ids, footprints }, image) = CANVAS.with_borrow_mut(|canvas| {
            let rendered = scene.render(num_instances, canvas);
            (rendered, sensor::take(canvas, scene.view.width, &sensor, &mut rng))
        });
        let instances = part_idxs
            .into_iter()
            .zip(&footprints)
            .enumerate()
            .map(|(body, (part_idx, footprint))| MixedInstance {
                part_idx,
                instance: instance(&self.subjects[part_idx], &scene, body, footprint, &ids),
            })
            .collect();
        MixedSample { image, instances }
    }

    /// A part of about the same size as another one, if a few draws find it.
    fn draw_of_size(&self, of: &[usize], part_idx: usize, rng: &mut Pcg64Mcg) -> usize {
        let diagonal = |idx: usize| self.subjects[idx].part.diagonal_mm();
        let ratio = |idx: usize| (diagonal(idx) / diagonal(part_idx)).ln().abs();
        let mut best = of[rng.whole(0, of.len() - 1)];
        for _ in 0..MAX_DRAWS {
            if ratio(best) < SIZE_RATIO.ln() {
                break;
            }
            let other = of[rng.whole(0, of.len() - 1)];
            best = if ratio(other) < ratio(best) { other } else { best };
        }
        best
    }
}

#[cfg(test)]
mod tests {
    use crate::{Part, SceneConfig, Scenes};

    #[test]
    fn several_parts_are_told_apart_and_lie_where_the_picture_shows_them() {
        let parts: Vec<Part> = (0..4).map(Part::generate).collect();
        let config = SceneConfig { instances: [3, 5], num_other_parts: 2, ..SceneConfig::default() };
        let scenes = Scenes::new(&parts, config, 5).unwrap();
        let samples: Vec<_> = (0..12).map(|index| scenes.mixed_sample(index)).collect();
        assert_eq!(samples[7], scenes.mixed_sample(7));
        let mut shown = [0; 4];
        for mixed in samples.iter().flat_map(|sample| &sample.instances) {
            shown[mixed.part_idx] += 1;
            let pose = mixed.instance.image_from_demonstration;
            let marks = scenes.photo(mixed.part_idx).demonstration.annotation.grasp.unwrap().transformed(&pose);
            assert!((marks.start - mixed.instance.grasp.start).norm() < 1.0);
        }
        assert!(shown.iter().all(|&count| count > 0), "{shown:?}");
    }
}
