//! The training pictures: each shows several generated parts, with ground truth and random access by index.

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

/// Every second part is, if possible, a look-alike of the part before it, so the network must learn to tell them apart.
const LOOK_ALIKE_EVERY: usize = 2;

/// Number of parts that a step tells apart.
const GROUP: usize = 8;
/// Number of parts adjacent in size from which a step's group is chosen: the size, which a photo gives only roughly,
/// must not be enough to identify a part.
const GROUP_FROM: usize = 20;

/// Minimum visible fraction of a part that is a training target.
pub(crate) const MIN_VISIBLE_SHARE: f64 = 0.35;

/// First seed of the training parts. Parts to measure on have smaller seeds.
pub const FIRST_PART_SEED: u64 = 1 << 32;

/// Scenes of 320×240 px in which the diagonal of parts is 22 to 140 px.
pub fn scene_config() -> SceneConfig {
    SceneConfig {
        photo: PhotoConfig { fill: [0.12, 0.45], ..PhotoConfig::default() },
        absent_share: 0.0,
        instances: [4, 9],
        // No other parts, which would be unlabelled: only tables and covers are background.
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
    /// Parts whose angle is ambiguous: their keypoints are no targets.
    is_symmetric: Vec<bool>,
    /// All parts, the smallest first.
    by_size: Vec<usize>,
    seed: u64,
}

impl Pictures {
    /// Generates `num_parts` parts.
    ///
    /// # Errors
    /// A scene configuration that the generator rejects.
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

    /// Number of parts.
    pub fn num_parts(&self) -> usize {
        self.is_symmetric.len()
    }

    /// The photo of a part's demonstration.
    pub fn photo(&self, part_idx: usize) -> &DemonstrationPhoto {
        self.scenes.photo(part_idx)
    }

    /// Picture `index` of a group of parts, with ground truth.
    pub fn mixed_sample(&self, group: &[usize], index: u64) -> MixedSample {
        self.scenes.mixed_sample_of(group, index)
    }

    /// Whether a part's angle is unambiguous.
    pub fn has_turn(&self, part_idx: usize) -> bool {
        !self.is_symmetric[part_idx]
    }

    /// Picture `index` of a group of parts as the network's input, and its targets in pixels of that input. A part's
    /// label is its position in the group.
    ///
    /// # Errors
    /// A picture that the network rejects.
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

/// Generates the parts of a seed: pairs of a part and, if possible, its look-alike.
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

/// The other part of a pair of [`draw_parts`]: the look-alike, or an unrelated part where no look-alike could be made.
pub fn look_alike_of(part_idx: usize) -> usize {
    part_idx ^ 1
}

/// The keypoints on the grasp line, start to end, in pixels of the network's input. Keypoints outside the box, and all
/// keypoints of a symmetric part, are unlabelled.
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
