//! Fits on two small parts in each half, with a few pictures and two constants.

use image::{Rgb, RgbImage};
use sdg_demonstration::{AugmentationConfig, Augmenter};
use sdg_geometry::{Angle, PlanarSimilarity, RotationalSymmetry};

use super::*;
use crate::teach::tests::demonstration;

/// The L-shaped part of the tests of teaching, in colours that depend on `idx`, with composed pictures.
fn part(idx: u8) -> FitPart {
    let mut taught = demonstration();
    taught.image = RgbImage::from_fn(taught.image.width(), taught.image.height(), |x, y| {
        let Rgb([r, g, b]) = *taught.image.get_pixel(x, y);
        Rgb([r, g.saturating_sub(10 * idx), b.saturating_add(20 * idx)])
    });
    let augmenter = Augmenter::new(&[taught.clone()], AugmentationConfig::default(), 5).unwrap();
    let pictures = (0..4)
        .map(|i| {
            let sample = augmenter.sample(10 * u64::from(idx) + i);
            let instances = sample
                .objects
                .iter()
                .map(|object| FitInstance {
                    grasp: taught.annotation.grasp.unwrap().transformed(&object.image_from_demonstration),
                    image_from_demonstration: object.image_from_demonstration,
                })
                .collect();
            FitPicture { image: sample.image, instances, undecided: Vec::new() }
        })
        .collect();
    FitPart { demonstration: taught, symmetry: RotationalSymmetry::None, pictures }
}

#[test]
fn a_fit_reports_today_and_the_best_of_the_grid() {
    let (training, held_out) = ([part(0), part(1)], [part(2), part(3)]);
    let names = ["search.shape.refinement.restart_px", "search.shape.structure.visible_from"];
    let options = FitOptions { seed: 1, only: names.map(str::to_owned).to_vec() };
    let mut heard = Vec::new();
    let report = fit(&training, &held_out, &options, &mut |event| match event {
        FitEvent::Searching { value, .. } => heard.push(*value),
        FitEvent::Fitted(constant) => assert!(names.contains(&constant.name)),
        FitEvent::Score(score) => assert!(score.before.accepted[1] > 0),
    })
    .unwrap();
    // The values of each constant except the present one.
    assert_eq!(heard, [5.0, 20.0, 0.2, 0.6]);
    assert_eq!(report.constants.len(), 2);
    for constant in &report.constants {
        let least = constant.trials.iter().map(|trial| trial.loss).fold(f64::INFINITY, f64::min);
        let fitted = constant.trials.iter().find(|trial| trial.value == constant.fitted).unwrap();
        assert!(fitted.loss <= least + 1e-9, "{constant:?}");
        assert!(constant.trials.iter().any(|trial| trial.value == constant.today), "{constant:?}");
    }
    assert_eq!(report.score.before, report.today);
    assert_eq!(report.today.false_alarms[1], 8);
    let num_instances: usize = held_out.iter().flat_map(|part| &part.pictures).map(|p| p.instances.len()).sum();
    assert_eq!(report.today.accepted[1], num_instances);
    assert!(num_instances > 0 && report.today.accepted[0] > 0, "{:?}", report.today);
    let printed = report.to_string();
    assert!(names.iter().all(|name| printed.contains(name)) && printed.contains("loss: today"), "{printed}");
    let again = fit(&training, &held_out, &options, &mut |_| {}).unwrap();
    assert_eq!(again, report);
}

#[test]
fn a_pose_is_right_within_its_tolerances_and_modulo_the_symmetry() {
    let taught = demonstration();
    let observed = |symmetry: RotationalSymmetry, moved_px: f64, turned_degrees: f64| {
        // The photo itself with a displaced ground truth, as if the search had found the part at that distance.
        let grasp = taught.annotation.grasp.unwrap();
        let pivot = taught.annotation.region().centroid();
        let to = pivot + nalgebra::Vector2::new(moved_px, 0.0);
        let truth = PlanarSimilarity::about(pivot, to, Angle::from_degrees(turned_degrees), 1.0);
        let instance = FitInstance { grasp: grasp.transformed(&truth), image_from_demonstration: truth };
        let picture = FitPicture { image: taught.image.clone(), instances: vec![instance], undecided: Vec::new() };
        let part = FitPart { demonstration: taught.clone(), symmetry, pictures: vec![picture] };
        let parts = [part];
        let prepared = PreparedPart::prepare_all(&parts, 1).unwrap();
        let observed = PreparedPart::observe_all(&prepared, &CheckConfig::DEFAULT).unwrap();
        observed[0].pictures[0].poses.iter().any(|pose| pose.instance_idx == Some(0))
    };
    // The box is 64 by 64 pixels: 4 % of its diagonal is 3.6 px.
    assert!(observed(RotationalSymmetry::None, 3.0, 0.0));
    assert!(!observed(RotationalSymmetry::None, 4.5, 0.0));
    assert!(!observed(RotationalSymmetry::None, 0.0, 15.0));
    assert!(!observed(RotationalSymmetry::None, 0.0, 90.0));
    assert!(observed(RotationalSymmetry::Fold(4), 0.0, 90.0));
    assert!(!observed(RotationalSymmetry::Fold(4), 0.0, 75.0));
}

#[test]
fn what_cannot_be_fitted_is_refused_by_name() {
    let parts = [part(0), part(1)];
    let options = FitOptions { seed: 1, only: vec!["search.num_point".into()] };
    let refused = fit(&parts, &parts, &options, &mut |_| {}).unwrap_err().to_string();
    assert!(refused.contains("search.num_points") && refused.contains("found \"search.num_point\""), "{refused}");
    let refused = fit(&parts[..1], &parts, &FitOptions::default(), &mut |_| {}).unwrap_err().to_string();
    assert_eq!(refused, "expected parts at least 2 on either side, found 1");
}

#[test]
fn todays_values_are_on_every_grid_and_a_value_that_is_set_is_there() {
    for constant in CONSTANTS {
        let mut config = CheckConfig::DEFAULT;
        let today = constant.get(&config);
        assert!(constant.grid.contains(&today), "{}: {today}", constant.name);
        for &value in constant.grid {
            constant.set(&mut config, value);
            assert!((constant.get(&config) - value).abs() < 1e-3, "{}: {value}", constant.name);
        }
        constant.set(&mut config, today);
        assert_eq!(config, CheckConfig::DEFAULT, "{}", constant.name);
    }
}

#[test]
fn examples_for_the_comparing_network_are_the_best_of_each_kind() {
    let part = part(0);
    let examples = likeness_examples(&part).unwrap();
    assert_eq!(likeness_examples(&part).unwrap(), examples);
    let num_instances: usize = part.pictures.iter().map(|picture| picture.instances.len()).sum();
    let right = examples.iter().filter(|example| example.is_right).count();
    assert!(right > 0 && right <= num_instances, "{right} of {num_instances}");
    for picture_idx in 0..part.pictures.len() {
        let wrong = examples.iter().filter(|example| !example.is_right && example.picture_idx == picture_idx).count();
        assert!(wrong <= 3, "{wrong} in picture {picture_idx}");
    }
}
