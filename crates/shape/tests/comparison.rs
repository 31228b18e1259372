//! Edges and surface together: poses that the edges refined poorly are refined again.

use crate::scenes;
use nalgebra::Point2;
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;
use sdg_geometry::{Angle, PlanarSimilarity};
use sdg_shape::{GradientField, SearchConfig, ShapeSearch};

/// Farther than this beside the part, in pixels, nothing is grasped.
const BESIDE_PX: f64 = 3.0;

/// What came of a start some pixels and degrees off.
struct Outcome {
    refined_px: f64,
    final_px: f64,
    refined: f64,
    start: f64,
    last: f64,
}

/// A part of the test scenes on a random table in random light.
fn refined_outcome(part_idx: usize, seed: u64) -> Outcome {
    let parts = scenes::parts();
    let part = &parts[part_idx];
    let mut rng = Pcg64Mcg::seed_from_u64(seed);
    let (image, outline, demonstration_from_part) = scenes::demonstration(part, 1, 0.05);
    let taught = ShapeSearch::new(&image, &outline, &SearchConfig::default()).unwrap();
    let image_from_part = scenes::pose(
        rng.random_range(150.0..490.0),
        rng.random_range(130.0..350.0),
        rng.random_range(-180.0..180.0),
        1.0,
    );
    let mut scene = scenes::Scene::random(&mut rng, 0.35);
    scene.place(part, image_from_part);
    let image = scene.render();
    let field = GradientField::new(&image);
    let comparison = taught.comparison(&image, &field);

    let pivot = outline.bounds().center();
    let truth = scenes::truth(&image_from_part, &demonstration_from_part);
    let off = |rng: &mut Pcg64Mcg, most: f64| rng.random_range(-most..most);
    let target = truth.apply(&pivot) + nalgebra::Vector2::new(off(&mut rng, 8.0), off(&mut rng, 8.0));
    let angle = truth.angle + Angle::from_degrees(off(&mut rng, 6.0));
    let start = PlanarSimilarity::about(pivot, Point2::from(target), angle, truth.scale);
    let refined = comparison.refined_by_edges(&start);
    let last = comparison.refine_pose(&start, refined, &(0.8..=1.25));
    let both = |pose: &PlanarSimilarity| comparison.agreement(pose).both();
    let px = |pose: &PlanarSimilarity| scenes::difference(pose, &truth, &pivot).0;
    assert_eq!(last, comparison.refine_pose(&start, refined, &(0.8..=1.25)));
    Outcome {
        refined_px: px(&refined),
        final_px: px(&last),
        refined: both(&refined),
        start: both(&start),
        last: both(&last),
    }
}

#[test]
fn refine_pose_lowers_no_agreement_and_fewer_poses_lie_beside() {
    // Long shadows: edges of the part's own direction right beside it.
    let all: Vec<Outcome> = (0..24).map(|seed| refined_outcome(seed as usize % 6, seed)).collect();
    for one in &all {
        assert!(one.last >= one.refined.max(one.start) - 0.0051, "{} {} {}", one.start, one.refined, one.last);
    }
    let beside = |px: fn(&Outcome) -> f64| all.iter().filter(|one| px(one) > BESIDE_PX).count();
    let (before, after) = (beside(|one| one.refined_px), beside(|one| one.final_px));
    assert!(after < before, "{before} of {} beside the part before, {after} after", all.len());
    let mean = |value: fn(&Outcome) -> f64| all.iter().map(value).sum::<f64>() / all.len() as f64;
    assert!(mean(|one| one.last) > mean(|one| one.refined));
}

#[test]
fn what_is_sure_is_left_where_the_edges_put_it() {
    let parts = scenes::parts();
    let (image, outline, _) = scenes::demonstration(&parts[0], 1, 0.05);
    let taught = ShapeSearch::new(&image, &outline, &SearchConfig::default()).unwrap();
    let field = GradientField::new(&image);
    let comparison = taught.comparison(&image, &field);
    let start = PlanarSimilarity { tx: 3.0, ..PlanarSimilarity::IDENTITY };
    let refined = comparison.refined_by_edges(&start);
    assert_eq!(comparison.refine_pose(&start, refined, &(0.8..=1.25)), refined);
}

#[test]
fn scales_stay_in_range() {
    let parts = scenes::parts();
    let (image, outline, _) = scenes::demonstration(&parts[0], 1, 0.05);
    let taught = ShapeSearch::new(&image, &outline, &SearchConfig::default()).unwrap();
    // Seen from twice as far, the part is half as large, and that is not allowed.
    let pivot = outline.bounds().center();
    let shrunk = image::imageops::resize(&image, 320, 240, image::imageops::FilterType::Triangle);
    let field = GradientField::new(&shrunk);
    let comparison = taught.comparison(&shrunk, &field);
    let half = PlanarSimilarity::about(pivot, Point2::from(pivot.coords * 0.5), Angle::ZERO, 0.56);
    let refined = comparison.refined_by_edges(&half);
    let narrow = comparison.refine_pose(&half, half, &(0.55..=0.6));
    assert!((0.55..=0.6).contains(&narrow.scale) && (refined.scale - 0.5).abs() < 0.02, "{narrow:?} {refined:?}");
}
