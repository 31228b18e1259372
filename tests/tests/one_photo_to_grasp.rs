//! End to end: one photo, teaching, unseen pictures, grasps in MuJoCo. Takes minutes, and is the test of the whole
//! product.

use std::ops::ControlFlow;

use sdg_evaluation::rehearsal::{Rehearsal, RehearsalErrors};
use sdg_evaluation::shipped;
use sdg_evaluation::trial::try_view;
use sdg_grasp::{CheckConfig, Device, GraspModel, TeachOptions, Verification, teach};
use sdg_simulation::objects::ObjectSpec;
use sdg_simulation::views::test_views;

/// First seed of the pictures; neither the demo nor the attempts use them.
const VIEWS_SEED: u64 = 1000;

#[test]
fn the_pendulum_is_taught_found_and_grasped() {
    let object = ObjectSpec::by_name("pendulum").unwrap();
    let demonstration = shipped::demonstration("pendulum").unwrap();
    // The camera's height is that of the photo: objects of another size are other parts.
    let mut options = TeachOptions::new(1);
    options.size_tolerance = CheckConfig::FIXED_HEIGHT_TOLERANCE;
    let taught = teach(&[demonstration], &options, &mut |_| ControlFlow::Continue(())).unwrap();
    let seconds = taught.model.facts().seconds;
    println!("taught in {seconds:.0} s: {:?}", taught.model.facts().validation);

    // From here on, the model read back from its file is used.
    let bytes = taught.model.to_bytes().unwrap();
    assert!(bytes.len() < 12_000_000, "{} bytes", bytes.len());
    let model = GraspModel::from_bytes(&bytes, &Device::flex()).unwrap();

    // Each picture is rendered once and shown to the network alone, then to the whole model.
    let mut right = [0; 2];
    let mut false_alarms = [0; 2];
    for (present, count) in [(true, 100), (false, 50)] {
        for seen in test_views(&object, present, count, VIEWS_SEED) {
            let seen = seen.unwrap();
            for (k, check) in [Verification::Off, Verification::ByShape].into_iter().enumerate() {
                let trial = try_view(&model, &object, &seen, check).unwrap();
                right[k] += usize::from(trial.is_right());
                false_alarms[k] += usize::from(trial.is_false_alarm());
            }
        }
    }
    println!("network alone: right on {} of 100, {} false alarms on 50", right[0], false_alarms[0]);
    assert!(right[0] >= 90, "network alone: right on {} of 100 unseen pictures", right[0]);
    assert!(false_alarms[0] <= 5, "network alone: {} false alarms on 50 pictures without the part", false_alarms[0]);

    println!("right on {} of 100 pictures, {} false alarms on 50 without the part", right[1], false_alarms[1]);
    assert!(right[1] >= 95, "right on {} of 100 unseen pictures", right[1]);
    assert_eq!(false_alarms[1], 0, "false alarms on 50 pictures without the part");

    let rehearsal = Rehearsal {
        model: &model,
        object: &object,
        attempts: 10,
        seed: 1,
        verification: Verification::ByShape,
        errors: RehearsalErrors::default(),
        camera: None,
        place: None,
    };
    // In order, like `Rehearsal::run`, without a film.
    let attempts = (1..=10).map(|number| rehearsal.attempt(number, None).unwrap().attempt);
    let failures: Vec<_> = attempts.filter(|attempt| !attempt.success).collect();
    println!("grasped in {} of 10, failures {failures:?}", 10 - failures.len());
    assert!(failures.len() <= 1, "{failures:?}");
}

/// Losses of the first steps of a teaching run, which ends without a model.
fn first_losses(seed: u64) -> Vec<f64> {
    const STEPS: usize = 3;
    let demonstration = shipped::demonstration("rod_end").unwrap();
    let mut losses = Vec::new();
    let ended = teach(&[demonstration], &TeachOptions::new(seed), &mut |event| {
        if let sdg_grasp::TeachingEvent::Step { record, .. } = event {
            losses.push(record.losses.total());
        }
        if losses.len() == STEPS { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    assert!(ended.unwrap_err().to_string().contains("no model to keep"));
    losses
}

#[test]
fn the_same_seed_teaches_the_same_bits_and_an_interrupt_leaves_nothing() {
    assert_eq!(first_losses(5), first_losses(5));
    assert_ne!(first_losses(5), first_losses(6));
}
