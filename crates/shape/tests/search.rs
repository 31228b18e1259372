//! Searches of whole images: rendered scenes with known poses, several parts, no part, and unusual images.

use crate::scenes;
use image::{Rgb, RgbImage};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;
use sdg_geometry::{BoundingBox, PlanarSimilarity, Polygon};
use sdg_shape::{SearchConfig, ShapeError, ShapeSearch};

/// Tolerances on another table under another light, as for refinement from a near start.
const TOLERANCE_PX: f64 = 2.0;
const TOLERANCE_DEG: f64 = 1.5;

/// The default with a change.
fn with(change: impl FnOnce(&mut SearchConfig)) -> SearchConfig {
    let mut config = SearchConfig::default();
    change(&mut config);
    config
}

struct Taught {
    search: ShapeSearch,
    outline: Polygon,
    demonstration_from_part: PlanarSimilarity,
    part: scenes::Part,
}

fn taught(part_idx: usize, config: &SearchConfig) -> Taught {
    let part = scenes::parts().swap_remove(part_idx);
    let (image, outline, demonstration_from_part) = scenes::demonstration(&part, 1, 0.05);
    let search = ShapeSearch::new(&image, &outline, config).expect("a part with edges");
    Taught { search, outline, demonstration_from_part, part }
}

impl Taught {
    fn truth(&self, image_from_part: &PlanarSimilarity) -> PlanarSimilarity {
        scenes::truth(image_from_part, &self.demonstration_from_part)
    }

    /// Pixels and degrees between a pose and the truth.
    fn error(&self, found: &PlanarSimilarity, image_from_part: &PlanarSimilarity) -> (f64, f64) {
        let (px, deg, _) = scenes::difference(found, &self.truth(image_from_part), &self.outline.bounds().center());
        (px, deg)
    }
}

proptest! {
    // Rendering takes most of the time.
    #![proptest_config(ProptestConfig { cases: 6, rng_seed: RngSeed::Fixed(11), failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_part_is_found_anywhere_turned_and_scaled(seed in 0u64..1_000_000) {
        let mut rng = Pcg64Mcg::seed_from_u64(seed);
        // Not the bearing, whose angle is undetermined, and not the thin fuel line.
        let taught = taught([0, 2, 4, 5][rng.random_range(0..4)], &SearchConfig::default());
        let image_from_part = scenes::pose(
            rng.random_range(150.0..490.0),
            rng.random_range(130.0..350.0),
            rng.random_range(-180.0..180.0),
            rng.random_range(0.8..1.25),
        );
        let mut scene = scenes::Scene::random(&mut rng, 0.05);
        scene.place(&taught.part, image_from_part);
        let matches = taught.search.search(&scene.render());
        prop_assert!(!matches.is_empty(), "{} not found", taught.part.name);
        let (px, deg) = taught.error(&matches[0].image_from_demonstration, &image_from_part);
        prop_assert!(px < TOLERANCE_PX && deg < TOLERANCE_DEG, "{}: {} px, {} deg", taught.part.name, px, deg);
        prop_assert!(matches.windows(2).all(|pair| pair[0].agreement >= pair[1].agreement));
    }
}

#[test]
fn two_of_a_kind_are_two_matches_and_not_three() {
    let taught = taught(0, &SearchConfig::default());
    let poses = [scenes::pose(170.0, 150.0, 30.0, 1.0), scenes::pose(460.0, 320.0, -110.0, 1.1)];
    let mut scene = scenes::Scene::plain(3);
    scene.light = [0.0, 0.0, 1.0];
    for pose in poses {
        scene.place(&taught.part, pose);
    }
    let matches = taught.search.search(&scene.render());
    assert_eq!(matches.len(), 2, "{matches:?}");
    for pose in poses {
        let near = |px: f64, deg: f64| px < TOLERANCE_PX && deg < TOLERANCE_DEG;
        let is_found =
            matches.iter().map(|m| taught.error(&m.image_from_demonstration, &pose)).any(|(px, deg)| near(px, deg));
        assert!(is_found, "{pose:?} in {matches:?}");
    }
}

#[test]
fn results_do_not_depend_on_the_number_of_threads() {
    let taught = taught(4, &SearchConfig::default());
    let mut scene = scenes::Scene::random(&mut Pcg64Mcg::seed_from_u64(5), 0.3);
    scene.place(&taught.part, scenes::pose(330.0, 220.0, 77.0, 0.9));
    let picture = scene.render();
    let with_threads = |num_threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(num_threads).build().expect("threads");
        pool.install(|| taught.search.search(&picture))
    };
    let one = with_threads(1);
    assert!(!one.is_empty());
    assert_eq!(one, with_threads(3));
}

/// A ring of 60 px on a plain ground: any angle is right.
fn ring(center: [f64; 2], contrast: f64) -> RgbImage {
    RgbImage::from_fn(320, 240, |x, y| {
        let radius = (f64::from(x) + 0.5 - center[0]).hypot(f64::from(y) + 0.5 - center[1]);
        let value = if (18.0..30.0).contains(&radius) { 120.0 + contrast } else { 120.0 };
        Rgb([value as u8; 3])
    })
}

fn ring_outline(center: [f64; 2]) -> Polygon {
    let vertices = (0..48)
        .map(|k| (f64::from(k) * std::f64::consts::TAU / 48.0).sin_cos())
        .map(|(sin, cos)| nalgebra::Point2::new(center[0] + 30.0 * cos, center[1] + 30.0 * sin))
        .collect();
    Polygon { vertices }
}

#[test]
fn a_round_part_is_found_once_also_in_weak_contrast() {
    let search = ShapeSearch::new(&ring([160.0, 120.0], 90.0), &ring_outline([160.0, 120.0]), &SearchConfig::default())
        .expect("a ring has edges");
    for contrast in [90.0, 12.0] {
        let matches = search.search(&ring([90.0, 151.0], contrast));
        assert_eq!(matches.len(), 1, "{matches:?}");
        let center = matches[0].image_from_demonstration.apply(&nalgebra::Point2::new(160.0, 120.0));
        assert!((center - nalgebra::Point2::new(90.0, 151.0)).norm() < 0.5, "{center}");
        assert!((matches[0].image_from_demonstration.scale - 1.0).abs() < 0.02);
    }
}

#[test]
fn nothing_is_found_in_blank_noisy_and_shaded_images() {
    let taught = taught(0, &SearchConfig::default());
    let mut rng = Pcg64Mcg::seed_from_u64(9);
    let mut noise = |amplitude: f64| {
        RgbImage::from_fn(640, 480, |_, _| {
            Rgb([0; 3].map(|_| rng.random_range(128.0 - amplitude..=128.0 + amplitude) as u8))
        })
    };
    let shaded = RgbImage::from_fn(640, 480, |x, y| Rgb([(x / 4) as u8, (y / 3) as u8, ((x + y) / 6) as u8]));
    for image in [RgbImage::new(640, 480), noise(0.0), noise(8.0), noise(127.0), shaded] {
        assert_eq!(taught.search.search(&image), Vec::new());
    }
    let table = scenes::Scene::random(&mut Pcg64Mcg::seed_from_u64(2), 0.2).render();
    assert_eq!(taught.search.search(&table), Vec::new());
}

#[test]
fn images_smaller_than_the_part_hold_nothing() {
    let taught = taught(0, &SearchConfig::default());
    for (width, height) in [(0, 0), (1, 1), (3, 200), (60, 60), (130, 50)] {
        let image = RgbImage::from_fn(width, height, |x, y| Rgb([(x * 7) as u8, (y * 5) as u8, 99]));
        assert_eq!(taught.search.search(&image), Vec::new(), "{width}x{height}");
    }
}

#[test]
fn a_tiny_part_is_found_and_a_smaller_one_refused() {
    let dot = |x: u32, y: u32, side: u32| {
        RgbImage::from_fn(160, 120, |col, row| {
            let inside = (x..x + side).contains(&col) && (y..y + side).contains(&row);
            Rgb(if inside { [30; 3] } else { [200; 3] })
        })
    };
    let outline =
        |x: f64, y: f64, side: f64| Polygon::from_box(&BoundingBox { x1: x, y1: y, x2: x + side, y2: y + side });
    let search = ShapeSearch::new(&dot(70, 50, 16), &outline(70.0, 50.0, 16.0), &SearchConfig::default())
        .expect("a square has edges");
    let matches = search.search(&dot(20, 81, 16));
    let center = matches[0].image_from_demonstration.apply(&nalgebra::Point2::new(78.0, 58.0));
    assert!((center - nalgebra::Point2::new(28.0, 89.0)).norm() < 0.5, "{center}");
    let refused = ShapeSearch::new(&dot(70, 50, 6), &outline(70.0, 50.0, 6.0), &SearchConfig::default());
    assert!(matches!(refused, Err(ShapeError::OutlineTooSmall { .. })));
    // A thin part is accepted upright and lying.
    let thin = |w: f64, h: f64| Polygon::from_box(&BoundingBox { x1: 10.0, y1: 10.0, x2: 10.0 + w, y2: 10.0 + h });
    for outline in [thin(6.0, 60.0), thin(60.0, 6.0)] {
        let made = ShapeSearch::new(&dot(10, 10, 60), &outline, &SearchConfig::default());
        assert!(!matches!(made, Err(ShapeError::OutlineTooSmall { .. })));
    }
}

#[test]
fn only_the_configured_scales_are_found() {
    let narrow = taught(0, &with(|config| config.scales = 0.97..=1.03));
    let picture = |scale: f64| {
        let mut scene = scenes::Scene::plain(8);
        scene.place(&narrow.part, scenes::pose(300.0, 240.0, 100.0, scale));
        scene.render()
    };
    assert_eq!(narrow.search.search(&picture(1.02)).len(), 1);
    assert_eq!(narrow.search.search(&picture(1.25)), Vec::new());
}

#[test]
fn a_part_is_found_with_half_and_with_twice_the_points() {
    for num_points in [32, 64, 128, 1024] {
        let taught = taught(0, &with(|config| config.num_points = num_points));
        let mut scene = scenes::Scene::plain(8);
        let pose = scenes::pose(300.0, 240.0, 100.0, 1.0);
        scene.place(&taught.part, pose);
        let matches = taught.search.search(&scene.render());
        let (px, deg) = taught.error(&matches[0].image_from_demonstration, &pose);
        assert!(px < TOLERANCE_PX && deg < TOLERANCE_DEG, "{num_points} points: {px} px, {deg} degrees");
    }
}

#[test]
fn bad_configurations_are_refused() {
    let (image, outline, _) = scenes::demonstration(&scenes::parts()[0], 1, 0.05);
    let refused = |config: SearchConfig| match ShapeSearch::new(&image, &outline, &config) {
        Err(ShapeError::InvalidConfig { name, .. }) => name,
        other => panic!("{other:?}"),
    };
    assert_eq!(refused(with(|config| config.scales = 0.1..=1.0)), "scales");
    assert_eq!(refused(with(|config| config.scales = 1.2..=0.9)), "scales");
    assert_eq!(refused(with(|config| config.scales = f64::NAN..=1.0)), "scales");
    assert_eq!(refused(with(|config| config.min_agreement = 1.5)), "min_agreement");
    assert_eq!(refused(with(|config| config.num_points = 7)), "num_points");
    assert_eq!(refused(with(|config| config.num_points = 1025)), "num_points");
    assert_eq!(refused(with(|config| config.shape.max_points = 3)), "max_points");
}
