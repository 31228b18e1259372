//! Fails if a network learns badly: tests model C's network alone, taught from one photo of a generated part, on
//! generated pictures with and without the part.
//!
//! Verification would hide weaknesses of the network, so it is off. The part is not a shipped one, and its pictures are
//! not rendered by the program that renders the network's training samples.

use std::ops::ControlFlow;

use sdg_geometry::PlanarGrasp;
use sdg_grasp::{GraspModel, TeachOptions, Verification, teach};
use sdg_part_generator::{Condition, Part, Sample, SceneConfig, Scenes};

/// Seed of the part, which has no symmetry, so that the angle counts.
const PART_SEED: u64 = 4;
/// Seed of the pictures.
const SCENES_SEED: u64 = 11;
/// Number of pictures with the part, and of pictures without it.
const NUM_PICTURES: u64 = 40;
/// Maximum distance of a hit, as a fraction of the diagonal of the part's box: 10 mm for a part of 150 mm.
const MAX_DISTANCE: f64 = 1.0 / 15.0;
/// Maximum angle error of a hit.
const MAX_TURN_DEG: f64 = 10.0;

/// Bounds for the network alone. Measured with seed 1, edge preset from the shipped weights, at most 120 steps: 31 hits
/// and no false alarm. Before the comparison network used finer views: 29 and 1. From random initialisation: 29 and 5
/// after 300 steps, 2 and 39 after 100.
const MIN_HITS: usize = 27;
const MAX_FALSE_ALARMS: usize = 2;

fn scenes(part: &Part, config: SceneConfig) -> Scenes {
    let config = SceneConfig { num_other_parts: 12, ..config };
    Scenes::new(std::slice::from_ref(part), config, SCENES_SEED).unwrap()
}

/// Whether the network's best detection is accepted and on the part.
fn is_hit(model: &GraspModel, part: &Part, sample: &Sample) -> bool {
    let detections = model.detect(&sample.image, Verification::Off).unwrap();
    let Some(best) = detections.first().filter(|best| best.is_accepted()) else { return false };
    let truth = &sample.instances[0];
    let expected = PlanarGrasp::from_line(&truth.grasp, truth.jaw_width_px);
    let diagonal = truth.bbox.width().hypot(truth.bbox.height());
    let distance = (best.grasp.x - expected.x).hypot(best.grasp.y - expected.y);
    let turn = part.symmetry().distance(best.grasp.angle, expected.angle);
    distance <= MAX_DISTANCE * diagonal && turn.to_degrees() <= MAX_TURN_DEG
}

#[test]
fn the_network_learns() {
    let part = Part::generate(PART_SEED);
    let with_part = scenes(&part, SceneConfig::only(Condition::Nominal));
    let without_part =
        scenes(&part, SceneConfig { absent_share: 1.0, others: [1, 4], ..SceneConfig::only(Condition::Nominal) });
    let demonstration = with_part.photo(0).demonstration.clone();
    let mut options = TeachOptions::new(1);
    options.symmetry = part.symmetry();
    let taught = teach(&[demonstration], &options, &mut |_| ControlFlow::Continue(())).unwrap();
    let model = taught.model;
    let hits = (0..NUM_PICTURES).filter(|&i| is_hit(&model, &part, &with_part.sample(i))).count();
    let is_false_alarm = |sample: Sample| {
        model.detect(&sample.image, Verification::Off).unwrap().first().is_some_and(|best| best.is_accepted())
    };
    let false_alarms = (0..NUM_PICTURES).filter(|&i| is_false_alarm(without_part.sample(i))).count();
    println!(
        "network alone, taught in {:.0} s: {hits} hits and {false_alarms} false alarms of {NUM_PICTURES} each",
        model.facts().seconds
    );
    assert!(hits >= MIN_HITS, "{hits} hits of {NUM_PICTURES}");
    assert!(false_alarms <= MAX_FALSE_ALARMS, "{false_alarms} false alarms of {NUM_PICTURES}");
}
