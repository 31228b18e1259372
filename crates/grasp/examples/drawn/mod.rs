//! Generated parts with pictures, for fitting, training or measuring.

use sdg_grasp::TaughtDemonstration;
use sdg_grasp::fitting::{FitInstance, FitPart, FitPicture};
use sdg_part_generator::{
    Condition, LookAlike, OtherKind, OtherObject, Part, PhotoConfig, SceneConfig, Scenes, demonstration,
};

pub type Result<T> = std::result::Result<T, Box<dyn std::error::Error>>;

/// Pictures without the part.
pub fn absent(condition: Condition) -> SceneConfig {
    SceneConfig { absent_share: 1.0, ..SceneConfig::only(condition) }
}

/// `count` parts that can be taught, each with as many pictures of each kind as `kinds` gives.
pub fn draw_parts(
    count: usize,
    [width, height]: [u32; 2],
    kinds: &[(SceneConfig, u64)],
    seed: u64,
) -> Result<Vec<FitPart>> {
    let photo = PhotoConfig { width, height, ..PhotoConfig::default() };
    // The seed of the photo to which the scenes' ground truth refers.
    let photo_seed = SceneConfig::default().photo_seed;
    let mut generated = Vec::new();
    let mut parts = Vec::new();
    for seed in (0u64..).map(|i| seed.wrapping_mul(1_000_000).wrapping_add(i)) {
        let part = Part::generate(seed);
        let demonstration = demonstration(&part, &photo, photo_seed);
        match TaughtDemonstration::new(&demonstration) {
            Ok(_) => {
                parts.push(FitPart { demonstration, symmetry: part.symmetry(), pictures: Vec::new() });
                generated.push(part);
            }
            Err(error) => eprintln!("part {seed} is left out: {error}"),
        }
        if parts.len() == count {
            break;
        }
    }
    for (kind_idx, (config, a_part)) in kinds.iter().enumerate() {
        // As in detection, the camera's distance is unknown, and parts may lie partly outside the picture.
        let config = SceneConfig {
            width,
            height,
            photo,
            photo_seed,
            distance: [0.75, 1.3],
            min_inside_share: 0.8,
            ..config.clone()
        };
        let scenes = Scenes::new(&generated, config, seed.wrapping_mul(100).wrapping_add(kind_idx as u64))?;
        for index in 0..parts.len() as u64 * a_part {
            let sample = scenes.sample(index);
            let instances = sample.instances.iter().map(|instance| FitInstance {
                grasp: instance.grasp,
                image_from_demonstration: instance.image_from_demonstration,
            });
            let is_of_other_size =
                |other: &&OtherObject| matches!(other.kind, OtherKind::LookAlike(LookAlike::Scaled(_)));
            parts[sample.part_idx].pictures.push(FitPicture {
                instances: instances.collect(),
                undecided: sample.others.iter().filter(is_of_other_size).map(|other| other.bbox).collect(),
                image: sample.image,
            });
        }
    }
    Ok(parts)
}
