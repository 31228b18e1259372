//! Model S end to end on every shipped part: one photo, no network, unseen pictures, grasps in MuJoCo.

use std::ops::ControlFlow;

use sdg_evaluation::rehearsal::{Rehearsal, RehearsalErrors};
use sdg_evaluation::shipped;
use sdg_evaluation::trial::{Trial, try_views};
use sdg_geometry::median;
use sdg_grasp::{Device, GraspModel, ModelKind, TeachOptions, Verification, teach};
use sdg_simulation::objects::ObjectSpec;

/// First seed of the pictures; neither `sdg evaluate` nor other tests use them.
const VIEWS_SEED: u64 = 7000;
/// Number of pictures of each part, with and without it.
const NUM_PRESENT: usize = 6;
const NUM_ABSENT: usize = 2;
/// Maximum median distance from the true grasp on the pictures of one part, and on all of them. The evaluation measured
/// 0.3 to 1.5 mm for single parts, and 0.6 mm for all.
const MAX_MEDIAN_OF_PART_MM: f64 = 2.3;
const MAX_MEDIAN_MM: f64 = 0.9;
/// Number of grasps of each part.
const NUM_ATTEMPTS: u32 = 1;

/// Minimum for the 6 pictures of one part. The evaluation finds 23 to 25 of 25 (datasets/RESULTS.md); the seeds are
/// fixed, so the result does not vary.
const MIN_RIGHT_OF_PART: usize = 5;
/// Minimum for all pictures of all parts: the evaluation's 98 %, minus two standard deviations for 72 pictures.
const MIN_RIGHT_SHARE: f64 = 0.95;
/// Maximum number of failed grasps, one attempt per part: 80 of 80 hold in the evaluation.
const MAX_DROPPED: usize = 1;

fn model_without_network(object: &ObjectSpec) -> GraspModel {
    let mut options = TeachOptions::new(1);
    options.kind = ModelKind::S;
    options.symmetry = object.symmetry;
    let demonstration = shipped::demonstration(&object.name).unwrap();
    let taught = teach(&[demonstration], &options, &mut |_| ControlFlow::Continue(())).unwrap();
    // From here on, the model read back from its file is used.
    GraspModel::from_bytes(&taught.model.to_bytes().unwrap(), &Device::flex()).unwrap()
}

#[test]
fn model_s_finds_and_grasps_every_part() {
    let (mut right, mut pictures, mut dropped, mut distances) = (0, 0, Vec::new(), Vec::new());
    for name in ObjectSpec::names() {
        let object = ObjectSpec::by_name(name).unwrap();
        let model = model_without_network(&object);
        let tried =
            |present, count| try_views(&model, &object, present, count, VIEWS_SEED, Verification::ByShape).unwrap();
        let trials = tried(true, NUM_PRESENT);
        let right_of_part = trials.iter().filter(|trial| trial.is_right()).count();
        let distances_of_part: Vec<f64> =
            trials.iter().filter_map(|trial| trial.error.as_ref()).map(|error| error.distance_mm).collect();
        let median_of_part = median(distances_of_part.iter().copied()).unwrap();
        let false_alarms = tried(false, NUM_ABSENT).iter().filter(|trial| Trial::is_false_alarm(trial)).count();
        let rehearsal = Rehearsal {
            model: &model,
            object: &object,
            attempts: NUM_ATTEMPTS,
            seed: 1,
            verification: Verification::ByShape,
            errors: RehearsalErrors::default(),
            camera: None,
            place: None,
        };
        // Like `Rehearsal::run`, without a film.
        let attempts = (1..=NUM_ATTEMPTS as usize).map(|number| rehearsal.attempt(number, None).unwrap().attempt);
        let failures: Vec<_> = attempts.filter(|attempt| !attempt.success).collect();
        println!(
            "{name}: right on {right_of_part} of {NUM_PRESENT}, median {median_of_part:.2} mm, {false_alarms} false alarms on \
             {NUM_ABSENT}, grasped in {} of {NUM_ATTEMPTS}",
            NUM_ATTEMPTS as usize - failures.len()
        );
        assert!(right_of_part >= MIN_RIGHT_OF_PART, "{name}: right on {right_of_part} of {NUM_PRESENT}");
        assert!(median_of_part <= MAX_MEDIAN_OF_PART_MM, "{name}: {distances_of_part:?} mm");
        assert_eq!(false_alarms, 0, "{name}: false alarms on {NUM_ABSENT} pictures without it");
        distances.extend(distances_of_part);
        right += right_of_part;
        pictures += NUM_PRESENT;
        dropped.extend(failures.into_iter().map(|failure| (name, failure)));
    }
    assert!(right as f64 >= MIN_RIGHT_SHARE * pictures as f64, "right on {right} of {pictures}");
    assert!(median(distances).unwrap() <= MAX_MEDIAN_MM);
    assert!(dropped.len() <= MAX_DROPPED, "{dropped:?}");
}
