//! From end to end: one photo, teaching, unseen pictures, grasps in MuJoCo. Takes minutes, and is the one
//! test that says whether the product works.

use std::ops::ControlFlow;

use sdg_evaluation::rehearsal::{Rehearsal, RehearsalErrors};
use sdg_evaluation::shipped;
use sdg_evaluation::trial::{Trial, try_views};
use sdg_grasp::{CheckConfig, Device, GraspModel, TeachOptions, Verification, teach};
use sdg_simulation::objects::ObjectSpec;

/// Seeds of the pictures; neither the demo's nor the attempts'.
const VIEWS_SEED: u64 = 1000;

#[test]
fn the_pendulum_is_taught_found_and_grasped() {
    let object = ObjectSpec::by_name("pendulum").unwrap();
    let demonstration = shipped::demonstration("pendulum").unwrap();
    // The camera hovers as high as it was for the photo: what has another size is another part.
    let mut options = TeachOptions::new(1);
    options.size_tolerance = CheckConfig::FIXED_HEIGHT_TOLERANCE;
    let taught = teach(&[demonstration], &options, &mut |_| ControlFlow::Continue(())).unwrap();
    let seconds = taught.model.facts().seconds;
    println!("taught in {seconds:.0} s: {:?}", taught.model.facts().validation);

    // What is used from here on is what a file gives back.
    let bytes = taught.model.to_bytes().unwrap();
    assert!(bytes.len() < 12_000_000, "{} bytes", bytes.len());
    let model = GraspModel::from_bytes(&bytes, &Device::flex()).unwrap();

    let tried = |present, count, check| try_views(&model, &object, present, count, VIEWS_SEED, check).unwrap();
    let right_alone = tried(true, 100, Verification::Off).iter().filter(|trial| trial.is_right()).count();
    let alarms_alone = tried(false, 50, Verification::Off).iter().filter(|trial| Trial::is_false_alarm(trial)).count();
    println!("network alone: right on {right_alone} of 100, {alarms_alone} false alarms on 50");
    assert!(right_alone >= 90, "network alone: right on {right_alone} of 100 unseen pictures");
    assert!(alarms_alone <= 5, "network alone: {alarms_alone} false alarms on 50 pictures without the part");

    let right = tried(true, 100, Verification::ByShape).iter().filter(|trial| trial.is_right()).count();
    let false_alarms =
        tried(false, 50, Verification::ByShape).iter().filter(|trial| Trial::is_false_alarm(trial)).count();
    println!("right on {right} of 100 pictures, {false_alarms} false alarms on 50 without the part");
    assert!(right >= 95, "right on {right} of 100 unseen pictures");
    assert_eq!(false_alarms, 0, "false alarms on 50 pictures without the part");

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
    let rehearsed = rehearsal.run(&mut |_| ControlFlow::Continue(())).unwrap();
    println!("grasped in {} of 10, failures {:?}", rehearsed.successes(), rehearsed.failures());
    assert!(rehearsed.successes() >= 9, "{:?}", rehearsed.failures());
}

/// Losses of the first steps of a teaching, which ends without a model.
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
