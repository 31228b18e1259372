//! Pictures with and without the part, and the models' detections in them.

use anyhow::{Context, Result};
use sdg_grasp::{GraspModel, Verification};
use sdg_simulation::objects::ObjectSpec;
use sdg_simulation::scene::{SceneVariation, VariationConfig};
use sdg_simulation::views::{TestView, test_view, test_views};

use super::records::{DetectionRecord, PictureRecord};
use crate::trial::{Trial, try_view};

/// A model's detections in a picture, with verification and without; the returned trial is the one with verification.
pub(super) fn observe_picture(
    model: &GraspModel,
    object: &ObjectSpec,
    seen: &TestView,
    seed: u64,
    other_part: Option<&str>,
) -> Result<(PictureRecord, Trial)> {
    let verified = try_view(model, object, seen, Verification::ByShape)?;
    let alone = match model.kind().has_network() {
        true => Some(DetectionRecord::new(&try_view(model, object, seen, Verification::Off)?)),
        false => None,
    };
    let other_part = other_part.map(str::to_owned);
    Ok((PictureRecord { seed, other_part, verified: DetectionRecord::new(&verified), alone }, verified))
}

/// A picture without the part: one to six unseen objects, some of which resemble parts. Every second picture also has
/// another of the paper's eight parts, each in turn, because the look-alikes in a workshop are real parts.
pub(super) fn scene_without(object: &ObjectSpec, number: u64, seed: u64) -> Result<(TestView, Option<&'static str>)> {
    if number.is_multiple_of(2) {
        return Ok((test_views(object, false, 1, seed).next().context("a picture")??, None));
    }
    let others: Vec<&'static str> = ObjectSpec::paper_names().filter(|name| *name != object.name).collect();
    let other = others[(number / 2) as usize % others.len()];
    let mut config = VariationConfig::default();
    config.distractors = 1..=*config.distractors.end();
    let scene = SceneVariation::sample(Some(&ObjectSpec::by_name(other)?), &config, seed);
    // The ground truth of the other part is not that of this part.
    Ok((TestView { truth: None, ..test_view(scene)? }, Some(other)))
}

/// The seed of a part's scenes, as for `sdg rehearse --seed`: the same for every model, and different for every part.
/// With the same seed for all parts, one scene with unfavourable light would count once for every part, and the
/// intervals would be too narrow.
pub(super) fn part_seed(seed: u64, object: &ObjectSpec) -> u64 {
    let place = ObjectSpec::names().position(|name| name == object.name).unwrap_or(0);
    seed.wrapping_mul(1000).wrapping_add(place as u64)
}

/// Seed of a part's pictures; differs from the seeds of attempts, of the demo and of tests.
pub(super) fn picture_seed(seed: u64, object: &ObjectSpec, number: u64) -> u64 {
    const PICTURES: u64 = 0x5049_4354_5552_4553;
    part_seed(seed, object).wrapping_mul(0xd134_2543_de82_ef95).wrapping_add(PICTURES).wrapping_add(number)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scenes_without_the_part_show_each_other_part_in_turn() {
        let object = ObjectSpec::by_name("pendulum").unwrap();
        let (seen, other) = scene_without(&object, 0, 5).unwrap();
        assert!(other.is_none() && seen.scene.object.is_none() && !seen.scene.distractors.is_empty());
        let (seen, other) = scene_without(&object, 3, 5).unwrap();
        assert_eq!(other, Some("rod_end"));
        assert_eq!(seen.scene.object.unwrap().spec.name, "rod_end");
        assert!(seen.truth.is_none());
        // A held-out part is in no other part's pictures, and all eight parts are in the pictures of a held-out part.
        for (name, expected) in [("pendulum", "fuel_line"), ("key", "pendulum")] {
            let object = ObjectSpec::by_name(name).unwrap();
            let others: Vec<_> =
                (0..8).map(|turn| scene_without(&object, 2 * turn + 1, 5).unwrap().1.unwrap()).collect();
            assert_eq!(others[0], expected);
            assert!(others.iter().all(|other| ObjectSpec::paper_names().any(|name| name == *other)), "{others:?}");
        }
    }

    #[test]
    fn no_part_or_picture_shares_a_seed() {
        let objects: Vec<_> = ObjectSpec::names().map(|name| ObjectSpec::by_name(name).unwrap()).collect();
        let mut seeds: Vec<u64> = [1, 2]
            .into_iter()
            .flat_map(|seed| objects.iter().flat_map(move |object| (0..50).map(move |n| picture_seed(seed, object, n))))
            .collect();
        seeds.sort_unstable();
        seeds.dedup();
        assert_eq!(seeds.len(), 2 * 12 * 50);
        assert_eq!(part_seed(1, &objects[2]), 1002);
    }
}
