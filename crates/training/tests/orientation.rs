//! Tests that the orientation CNN learns, that the result is repeatable, and that every
//! parameter contributes.
#![allow(clippy::unwrap_used)]

use std::ops::ControlFlow;
use std::time::Duration;

use burn::tensor::Device;
use image::{Rgb, RgbImage};
use sdg_geometry::Angle;
use sdg_orientation::OrientationConfig;
use sdg_training::orientation::{LabelledCrop, OrientationEvent, OrientationTraining, TrainedOrientation, train};
use sdg_training::{Ending, OneCycle, TrainingError};

/// A bar through the centre at an angle, bright towards its end.
fn bar(degrees: f64) -> LabelledCrop {
    let (sin, cos) = degrees.to_radians().sin_cos();
    let crop = RgbImage::from_fn(32, 32, |x, y| {
        let (dx, dy) = (f64::from(x) - 15.5, f64::from(y) - 15.5);
        let (along, across) = (dx * cos + dy * sin, dy * cos - dx * sin);
        let inside = along.abs() < 13.0 && across.abs() < 4.0;
        Rgb(if inside { [(150.0 + 7.0 * along) as u8, 80, 80] } else { [60; 3] })
    });
    LabelledCrop { crop, angle: Angle::from_degrees(degrees) }
}

/// Four bars per scene, distributed over the circle by the golden angle.
fn bars(scene_idx: u64) -> Vec<LabelledCrop> {
    (0..4).map(|i| bar(137.508 * (4 * scene_idx + i) as f64)).collect()
}

fn network() -> OrientationConfig {
    OrientationConfig {
        input_px: 32,
        stage_channels: vec![8, 16, 32],
        stage_convs: vec![1, 1, 1],
        hidden: 64,
        ..OrientationConfig::edge()
    }
}

fn settings(steps: usize) -> OrientationTraining {
    OrientationTraining {
        steps,
        schedule: OneCycle { peak: 5e-3, warm_up: 0.2 },
        validation_crops: 24,
        ..OrientationTraining::edge(4)
    }
}

fn run(
    settings: &OrientationTraining,
    observe: &mut dyn FnMut(&OrientationEvent) -> ControlFlow<()>,
) -> TrainedOrientation {
    let untaught = network().init(&Device::flex().autodiff(), 4).unwrap();
    let held_out: Vec<LabelledCrop> = (0..24).map(|i| bar(7.3 + 15.0 * f64::from(i))).collect();
    train(untaught, settings, &bars, &held_out, observe).unwrap()
}

#[test]
fn ten_steps_on_bars_lower_the_loss_the_same_way_twice() {
    let losses = || {
        let mut losses = Vec::new();
        let taught = run(&settings(10), &mut |event| {
            if let OrientationEvent::Step { loss, .. } = event {
                losses.push(*loss);
            }
            ControlFlow::Continue(())
        });
        (losses, taught.network.state_dict())
    };
    let ((first, weights), (again, same_weights)) = (losses(), losses());
    assert_eq!(first.len(), 10);
    // Before the first step all angles are equally likely: ln 360.
    assert!((first[0] - 360f64.ln()).abs() < 0.1, "{first:?}");
    assert!(first[9] < first[0] - 0.3, "{first:?}");
    assert_eq!((first, weights), (again, same_weights));
}

#[test]
fn every_parameter_takes_part() {
    let before = network().init(&Device::flex(), 4).unwrap().state_dict();
    let after = run(&settings(3), &mut |_| ControlFlow::Continue(())).network.state_dict();
    for (name, values) in before {
        assert_ne!(values, after[&name], "{name}");
    }
}

#[test]
fn bars_are_learnt_in_a_few_steps() {
    let taught = run(&settings(90), &mut |_| ControlFlow::Continue(()));
    assert_eq!((taught.steps, taught.ending), (90, Ending::Completed));
    assert!(taught.errors.hit_rate() > 0.95 && taught.errors.median_degrees() < 3.0, "{:?}", taught.errors);
}

#[test]
fn a_run_can_be_ended_from_outside_and_by_the_clock() {
    let stopped = run(&settings(50), &mut |event| match event {
        OrientationEvent::Step { step: 1, .. } => ControlFlow::Break(()),
        _ => ControlFlow::Continue(()),
    });
    assert_eq!((stopped.steps, stopped.ending), (2, Ending::Interrupted));
    let hurried = OrientationTraining { time_budget: Some(Duration::from_millis(1)), ..settings(50) };
    assert_eq!(run(&hurried, &mut |_| ControlFlow::Continue(())).ending, Ending::TimeBudget);
}

#[test]
fn a_loss_that_is_no_number_is_an_error() {
    let untaught = network().init(&Device::flex().autodiff(), 4).unwrap();
    let wild = OrientationTraining { schedule: OneCycle { peak: 1e30, warm_up: 0.2 }, ..settings(20) };
    let result = train(untaught, &wild, &bars, &[bar(0.0)], &mut |_| ControlFlow::Continue(()));
    assert!(matches!(result, Err(TrainingError::Diverged { .. })), "{:?}", result.map(|taught| taught.steps));
}
