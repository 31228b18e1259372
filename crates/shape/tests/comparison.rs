//! Tests of refinement by edges and surface together, and of the close look.

use crate::scenes;
use image::{Rgb, RgbImage};
use nalgebra::Point2;
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;
use sdg_geometry::{Angle, BoundingBox, PlanarSimilarity, Polygon};
use sdg_shape::{CloseLook, GradientField, Picture, SearchConfig, ShapeSearch, TableColors};

/// A pose with a larger error, in pixels, lies beside the part.
const BESIDE_PX: f64 = 3.0;

/// The results from a start with errors of some pixels and degrees.
struct Outcome {
    refined_px: f64,
    final_px: f64,
    refined: f64,
    start: f64,
    last: f64,
}

/// Refines a wrong pose of a part on a random table in random light.
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
    let (field, table) = (GradientField::new(&image), TableColors::new(&image));
    let comparison = taught.comparison(&Picture { image: &image, field: &field, table: &table });

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
    // Long shadows: edges of the part's own direction directly beside it.
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
    let (field, table) = (GradientField::new(&image), TableColors::new(&image));
    let comparison = taught.comparison(&Picture { image: &image, field: &field, table: &table });
    let start = PlanarSimilarity { tx: 3.0, ..PlanarSimilarity::IDENTITY };
    let refined = comparison.refined_by_edges(&start);
    assert_eq!(comparison.refine_pose(&start, refined, &(0.8..=1.25)), refined);
}

#[test]
fn scales_stay_in_range() {
    let parts = scenes::parts();
    let (image, outline, _) = scenes::demonstration(&parts[0], 1, 0.05);
    let taught = ShapeSearch::new(&image, &outline, &SearchConfig::default()).unwrap();
    // From twice the distance, the part is half as large; the allowed scales exclude this.
    let pivot = outline.bounds().center();
    let shrunk = image::imageops::resize(&image, 320, 240, image::imageops::FilterType::Triangle);
    let (field, table) = (GradientField::new(&shrunk), TableColors::new(&shrunk));
    let comparison = taught.comparison(&Picture { image: &shrunk, field: &field, table: &table });
    let half = PlanarSimilarity::about(pivot, Point2::from(pivot.coords * 0.5), Angle::ZERO, 0.56);
    let refined = comparison.refined_by_edges(&half);
    let narrow = comparison.refine_pose(&half, half, &(0.55..=0.6));
    assert!((0.55..=0.6).contains(&narrow.scale) && (refined.scale - 0.5).abs() < 0.02, "{narrow:?} {refined:?}");
}

/// A light plate with a dark bar and a hole, moved right by `shift`, on a blue table. `bar` is the x of the bar's left
/// edge, `hole` that of the hole's centre.
fn plate(shift: f64, bar: f64, hole: f64, length: f64) -> RgbImage {
    RgbImage::from_fn(320, 240, |x, y| {
        let (x, y) = (f64::from(x) - shift, f64::from(y));
        let on_plate = (60.0..60.0 + length).contains(&x) && (80.0..150.0).contains(&y);
        let on_bar = (bar..bar + 14.0).contains(&x) && (90.0..125.0).contains(&y);
        let in_hole = (x - hole).hypot(y - 135.0) < 9.0;
        // Texture, so that no area is free of noise.
        let grain = ((x * 12.989 + y * 78.233).sin() * 43_758.545).fract().abs() * 6.0;
        let color = if !on_plate || in_hole {
            [40.0, 60.0, 130.0]
        } else if on_bar {
            [70.0; 3]
        } else {
            [205.0; 3]
        };
        Rgb(color.map(|value: f64| (value + grain) as u8))
    })
}

/// The photo's outline is that of the whole plate.
fn plate_look(picture: &RgbImage, pose: &PlanarSimilarity) -> CloseLook {
    let outline = Polygon::from_box(&BoundingBox { x1: 60.0, y1: 80.0, x2: 200.0, y2: 150.0 });
    let taught = ShapeSearch::new(&plate(0.0, 75.0, 180.0, 140.0), &outline, &SearchConfig::default()).unwrap();
    let (field, table) = (GradientField::new(picture), TableColors::new(picture));
    taught.comparison(&Picture { image: picture, field: &field, table: &table }).close_look(pose)
}

#[test]
fn a_close_look_finds_nothing_against_the_part_itself() {
    let look =
        plate_look(&plate(30.0, 75.0, 180.0, 140.0), &PlanarSimilarity { tx: 30.0, ..PlanarSimilarity::IDENTITY });
    assert!(look.fit > 0.9 && look.bare == 0.0 && look.no_rim == 0.0 && look.added < 0.01, "{look:?}");
    assert!(look.mirrored.is_some_and(|rival| rival.margin > 0.3 && rival.share > 0.1), "{look:?}");
}

#[test]
fn table_where_the_part_should_be_is_bare_and_has_no_rim() {
    // A plate of half the length: the other half of the outline lies on the table.
    let look = plate_look(&plate(0.0, 75.0, 110.0, 75.0), &PlanarSimilarity::IDENTITY);
    assert!((0.3..0.6).contains(&look.bare) && look.no_rim > 0.3, "{look:?}");
    // An object that covers some of the plate is not table.
    let mut covered = plate(0.0, 75.0, 180.0, 140.0);
    for (x, y) in (150..205).flat_map(|x| (100..156).map(move |y| (x, y))) {
        covered.put_pixel(x, y, Rgb([224, 172, 140]));
    }
    let look = plate_look(&covered, &PlanarSimilarity::IDENTITY);
    assert!(look.bare < 0.05, "{look:?}");
}

#[test]
fn the_mirror_image_fits_its_own_picture_better_than_the_photo() {
    // Mirrored about the plate's middle, x = 130: bar and hole change sides.
    let look = plate_look(&plate(0.0, 171.0, 80.0, 140.0), &PlanarSimilarity::IDENTITY);
    assert!(look.mirrored.is_some_and(|rival| rival.margin < -0.3), "{look:?}");
}

#[test]
fn more_edges_inside_the_outline_are_seen() {
    let mut printed = plate(0.0, 75.0, 180.0, 140.0);
    for (x, y) in (100..165).flat_map(|x| (86..146).map(move |y| (x, y))).filter(|(x, y)| (x / 5 + y / 5) % 2 == 0) {
        printed.put_pixel(x, y, Rgb([20; 3]));
    }
    let (plain, more) = (plate(0.0, 75.0, 180.0, 140.0), printed);
    let added = |picture: &RgbImage| plate_look(picture, &PlanarSimilarity::IDENTITY).added;
    assert!(added(&plain) < 0.01 && added(&more) > 0.05, "{} {}", added(&plain), added(&more));
}

#[test]
fn a_part_that_is_its_own_mirror_image_has_no_rival() {
    let outline = Polygon::from_box(&BoundingBox { x1: 60.0, y1: 80.0, x2: 200.0, y2: 150.0 });
    // The bar in the middle, and no hole.
    let photo = plate(0.0, 123.0, -100.0, 140.0);
    let taught = ShapeSearch::new(&photo, &outline, &SearchConfig::default()).unwrap();
    let (field, table) = (GradientField::new(&photo), TableColors::new(&photo));
    let comparison = taught.comparison(&Picture { image: &photo, field: &field, table: &table });
    assert_eq!(comparison.close_look(&PlanarSimilarity::IDENTITY).mirrored, None);
}
