//! What is learnt from: pictures of several generated parts each, with the truth, by random access.

use anyhow::Result;
use rand::seq::SliceRandom;
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;
use sdg_demonstration::NUM_KEYPOINTS;
use sdg_detection::ResizedTarget;
use sdg_detection::{ImageTransform, ObjectMask, RcnnConfig, TransformedImage};
use sdg_geometry::{BoundingBox, GraspLine, Keypoint, Polygon, RotationalSymmetry, Visibility};
use sdg_part_generator::{
    DemonstrationPhoto, LookAlike, MixedInstance, MixedSample, Part, PhotoConfig, SceneConfig, Scenes,
};

/// Every so many parts, one is a look-alike of the part before it: what tells the two apart must be learnt.
const LOOK_ALIKE_EVERY: usize = 2;

/// Parts that a step tells apart, and the parts next to each other by size that they are drawn from: the size alone, which
/// a photo gives away only roughly, shall not tell which it is.
const GROUP: usize = 8;
const GROUP_FROM: usize = 20;

/// Parts of which less is visible are not asked for.
pub(crate) const MIN_VISIBLE_SHARE: f64 = 0.35;

/// Seeds of the parts that are learnt from. Parts to measure on have seeds below [`FIRST_PART_SEED`].
pub const FIRST_PART_SEED: u64 = 1 << 32;

/// Scenes of 320×240 px in which parts have 22 to 140 px of diagonal.
pub fn scene_config() -> SceneConfig {
    SceneConfig {
        photo: PhotoConfig { fill: [0.12, 0.45], ..PhotoConfig::default() },
        absent_share: 0.0,
        instances: [4, 9],
        // Every part in the picture is labelled; nothing but tables and covers is background.
        others: [0, 0],
        look_alike_share: 0.0,
        num_other_parts: 0,
        cover_probability: 0.12,
        min_inside_share: 0.8,
        ..SceneConfig::default()
    }
}

/// The pictures of a seed.
pub struct Pictures {
    scenes: Scenes,
    transform: ImageTransform,
    /// Parts whose turn cannot be told: their keypoints are not asked for.
    is_symmetric: Vec<bool>,
    /// All parts, the smallest first; look-alikes stand beside each other.
    by_size: Vec<usize>,
    seed: u64,
}

impl Pictures {
    /// Prepares so many parts.
    ///
    /// # Errors
    /// A scene configuration that the generator refuses.
    pub fn new(num_parts: usize, network: &RcnnConfig, seed: u64) -> Result<Self> {
        let parts = draw_parts(num_parts, seed);
        let is_symmetric = parts.iter().map(|part| part.symmetry() != RotationalSymmetry::None).collect();
        let mut by_size: Vec<usize> = (0..parts.len()).collect();
        by_size.sort_by(|one, other| parts[*one].diagonal_mm().total_cmp(&parts[*other].diagonal_mm()));
        let scenes = Scenes::new(&parts, scene_config(), seed)?;
        Ok(Self { scenes, transform: ImageTransform::new(&network.input), is_symmetric, by_size, seed })
    }

    /// The parts that a step tells apart.
    pub fn group(&self, step: usize) -> Vec<usize> {
        let mut rng = Pcg64Mcg::seed_from_u64(self.seed ^ (step as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15));
        let count = GROUP_FROM.min(self.by_size.len());
        let first = rng.random_range(0..=self.by_size.len() - count);
        let mut group = self.by_size[first..first + count].to_vec();
        group.shuffle(&mut rng);
        group.truncate(GROUP);
        group
    }

    /// How many parts there are.
    pub fn num_parts(&self) -> usize {
        self.is_symmetric.len()
    }

    /// The photo that a part is demonstrated by.
    pub fn photo(&self, part_idx: usize) -> &DemonstrationPhoto {
        self.scenes.photo(part_idx)
    }

    /// Picture `index` of a group of parts, with the truth.
    pub fn mixed_sample(&self, group: &[usize], index: u64) -> MixedSample {
        self.scenes.mixed_sample_of(group, index)
    }

    /// Whether a part's turn can be told.
    pub fn has_turn(&self, part_idx: usize) -> bool {
        !self.is_symmetric[part_idx]
    }

    /// Picture `index` of a group of parts as the network gets it, and what is in it, in pixels of the network's input. A
    /// part's label is its place in the group.
    ///
    /// # Errors
    /// A picture that the network refuses.
    pub fn picture(&self, group: &[usize], index: u64) -> Result<(TransformedImage, ResizedTarget)> {
        let MixedSample { image, instances } = self.mixed_sample(group, index);
        let transformed = self.transform.apply(&image)?;
        let [sx, sy] = transformed.resized_from_original();
        let (width, height) = (f64::from(image.width()), f64::from(image.height()));
        let mut target = ResizedTarget::default();
        for MixedInstance { part_idx, instance } in instances {
            let (bbox, outline) = (instance.bbox.clip(width, height), instance.outline());
            if instance.visible_share < MIN_VISIBLE_SHARE || bbox.width() < 4.0 || bbox.height() < 4.0 {
                continue;
            }
            let outline = outline.unwrap_or_else(|| Polygon::from_box(&bbox));
            target.boxes.push(transformed.resized_box(&bbox));
            target.labels.extend(group.iter().position(|one| *one == part_idx));
            target.keypoints.push(keypoints(&instance.grasp, self.is_symmetric[part_idx], &bbox, [sx, sy]));
            target.masks.push(ObjectMask::from(outline.scaled(sx, sy)));
        }
        Ok((transformed, target))
    }
}

/// The parts of a seed, each as often as any other.
pub fn draw_parts(num_parts: usize, seed: u64) -> Vec<Part> {
    let first = FIRST_PART_SEED.wrapping_add(seed.wrapping_mul(1_000_000));
    let mut parts: Vec<Part> = Vec::with_capacity(num_parts);
    for i in 0..num_parts {
        let look_alike = parts.last().filter(|_| i % LOOK_ALIKE_EVERY == LOOK_ALIKE_EVERY - 1).and_then(|part| {
            let kinds = [LookAlike::Mirrored, LookAlike::FeatureMoved];
            let [one, other] = if i % 4 == 1 { kinds } else { [kinds[1], kinds[0]] };
            part.look_alike(one, i as u64).or_else(|| part.look_alike(other, i as u64))
        });
        parts.push(look_alike.unwrap_or_else(|| Part::generate(first.wrapping_add(i as u64))));
    }
    parts
}

/// The part that one of [`draw_parts`] was made to look like, or that was made to look like it; another part where none
/// could be made.
pub fn look_alike_of(part_idx: usize) -> usize {
    part_idx ^ 1
}

/// The keypoints on the grasp line, start to end, in pixels of the network's input; unlabelled outside the box.
fn keypoints(grasp: &GraspLine, is_symmetric: bool, bbox: &BoundingBox, [sx, sy]: [f64; 2]) -> Vec<Keypoint> {
    let labelled = |keypoint: Keypoint| {
        let visibility = match !is_symmetric && bbox.contains(&keypoint.point()) {
            true => Visibility::Visible,
            false => Visibility::Unlabelled,
        };
        Keypoint { x: keypoint.x * sx, y: keypoint.y * sy, visibility }
    };
    grasp.keypoints(NUM_KEYPOINTS).into_iter().map(labelled).collect()
}
