//! Tests that samples depend only on seed and index, and that their ground truth agrees with the picture.
#![allow(clippy::unwrap_used)]

use rayon::prelude::*;
use sdg_geometry::RotationalSymmetry;
use sdg_part_generator::{
    Condition, LookAlike, Part, PartKind, PhotoConfig, Sample, SceneConfig, Scenes, demonstration,
};

fn scenes(config: SceneConfig, parts: u64) -> Scenes {
    let parts: Vec<Part> = (0..parts).map(|k| Part::generate(30 + k)).collect();
    Scenes::new(&parts, SceneConfig { num_other_parts: 4, ..config }, 11).unwrap()
}

#[test]
fn random_access_on_many_threads_equals_one_after_the_other() {
    let scenes = scenes(SceneConfig::default(), 2);
    let sequential: Vec<Sample> = (0..6).map(|k| scenes.sample(k)).collect();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(3).build().unwrap();
    let parallel: Vec<Sample> =
        pool.install(|| vec![5u64, 4, 3, 2, 1, 0].into_par_iter().map(|k| scenes.sample(k)).collect());
    for (one, other) in sequential.iter().zip(parallel.iter().rev()) {
        assert!(one == other);
    }
    let again = self::scenes(SceneConfig::default(), 2);
    assert!(again.sample(3) == sequential[3]);
    assert!(sequential[2].image != sequential[4].image);
}

/// Maximum mean distance between outlines. A wrong position or angle gives tens of pixels; walls of the tested parts
/// give less than this.
const MAX_MEAN_DISTANCE_PX: f64 = 4.0;

#[test]
fn the_truth_lies_on_the_part() {
    for condition in [Condition::Nominal, Condition::Tilt, Condition::Distance] {
        let scenes = scenes(SceneConfig::only(condition), 3);
        for index in 0..6 {
            let sample = scenes.sample(index);
            let taught = &scenes.photo(sample.part_idx).demonstration.annotation;
            let instance = &sample.instances[0];
            // The marks are the demonstration's, transformed with the part.
            let moved = instance.image_from_demonstration.apply(&taught.grasp.unwrap().center());
            assert!((moved - instance.grasp.center()).norm() < 1e-6);
            assert!((instance.scale * scenes.sample(index).conditions.distance - 1.0).abs() < 0.25);
            // Without tilt, the demonstration's outline, transformed with the part, equals the instance's outline,
            // except for visible walls of tall parts.
            if condition == Condition::Nominal {
                let outline = taught.outline.as_ref().unwrap().transformed(&instance.image_from_demonstration);
                let found = instance.outline().unwrap();
                let distances = outline.vertices.iter().map(|vertex| found.distance_to_edge(vertex));
                let mean = distances.sum::<f64>() / outline.vertices.len() as f64;
                assert!(mean < MAX_MEAN_DISTANCE_PX, "{:?} {index}: {mean}", scenes.part(sample.part_idx).kind());
            }
        }
    }
}

#[test]
fn visibility_is_the_share_of_the_silhouette_that_the_picture_shows() {
    let scenes = scenes(SceneConfig::only(Condition::Cover), 2);
    let mut covered = 0;
    for index in 0..10 {
        let sample = scenes.sample(index);
        for (id, instance) in sample.instances.iter().enumerate() {
            let (mask, [x0, y0]) = instance.silhouette();
            let (mut all, mut shown) = (0usize, 0usize);
            for y in 0..mask.height() {
                for x in (0..mask.width()).filter(|&x| mask.get(x, y)) {
                    all += 1;
                    let (px, py) = (x as i32 + x0, y as i32 + y0);
                    let inside = px >= 0 && py >= 0 && px < 320 && py < 240;
                    shown += usize::from(inside && usize::from(sample.ids[(py * 320 + px) as usize]) == id);
                }
            }
            assert!((instance.visible_share - shown as f64 / all as f64).abs() < 1e-9);
            covered += usize::from(instance.visible_share < 0.93);
        }
    }
    // A cover is placed only where its covered fraction fits; some parts are too thin for any cover.
    assert!(covered >= 5, "{covered} of 10 covered");
}

#[test]
fn conditions_do_what_they_say() {
    let sample = |condition| scenes(SceneConfig::only(condition), 1).sample(1);
    let brightness = |sample: &Sample| {
        sample.image.as_raw().iter().map(|&v| f64::from(v)).sum::<f64>() / sample.image.as_raw().len() as f64
    };
    assert!(brightness(&sample(Condition::Dark)) < 0.8 * brightness(&sample(Condition::Nominal)));
    assert!((5f64..20.01).contains(&sample(Condition::Tilt).conditions.tilt_rad.to_degrees()));
    assert!(sample(Condition::Instances).instances.len() >= 2);
    let config = SceneConfig { absent_share: 1.0, ..SceneConfig::default() };
    assert!(scenes(config, 1).sample(0).instances.is_empty());
}

#[test]
fn a_configuration_out_of_range_is_refused() {
    let part = [Part::generate(1)];
    let refused = |config: SceneConfig| Scenes::new(&part, config, 0).err().map(|error| error.to_string());
    let tilt = SceneConfig { tilt_rad: [0.0, 3.0], ..SceneConfig::default() };
    assert!(refused(tilt).unwrap().contains("tilt_rad"));
    assert!(refused(SceneConfig { width: 8, ..SceneConfig::default() }).unwrap().contains("8x240"));
    assert!(Scenes::new(&[], SceneConfig::default(), 0).is_err());
}

#[test]
fn every_kind_has_a_demonstration_that_passes_the_checks() {
    for kind in PartKind::ALL {
        let part = Part::generate_of_kind(kind, 3);
        let taught = demonstration(&part, &PhotoConfig::default(), 2);
        assert_eq!(taught.check(), Ok(()), "{kind:?}");
        assert!(taught.annotation.outline.is_some() && taught.annotation.jaw_width.is_some());
        assert!(part.grasp().jaw_width_mm <= 80.0 && part.diagonal_mm() < 260.0);
        let other = demonstration(&part, &PhotoConfig::default(), 3);
        assert!(taught.image != other.image);
    }
}

#[test]
fn look_alikes_are_other_parts() {
    let mut mirrored = 0;
    for seed in 0..12 {
        let part = Part::generate(seed);
        if part.symmetry() == RotationalSymmetry::Full {
            // A body of revolution is its own mirror image.
            assert!(part.look_alike(LookAlike::Mirrored, 0).is_none());
        }
        mirrored += usize::from(part.look_alike(LookAlike::Mirrored, 0).is_some());
        let larger = part.look_alike(LookAlike::Scaled(1.1), 0).unwrap();
        assert!((larger.diagonal_mm() / part.diagonal_mm() - 1.1).abs() < 1e-6);
        assert!(part.look_alike(LookAlike::Scaled(1.0), 0).is_none());
    }
    assert!(mirrored >= 4, "{mirrored}");
}
