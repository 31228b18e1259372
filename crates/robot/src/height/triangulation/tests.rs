//! Two views of a part whose height is known.

use nalgebra::{Isometry3, Point3};
use proptest::prelude::*;

use super::*;
use crate::grasp_target::GraspTarget;

/// The exact sighting, in a plane at `plane_m`, of a part at (`part_x_m`, 0.02, `height_m`) by a camera at
/// (`camera_x_m`, 0, `camera_z_m`).
fn shown([camera_x_m, camera_z_m]: [f64; 2], part_x_m: f64, height_m: f64, plane_m: f64) -> Sighting {
    let share = (camera_z_m - plane_m) / (camera_z_m - height_m);
    let middle_m = Point3::new(camera_x_m + (part_x_m - camera_x_m) * share, 0.02 * share, plane_m);
    let base_from_tcp = Isometry3::translation(middle_m.x, middle_m.y, plane_m - 0.005);
    Sighting {
        camera_m: Point3::new(camera_x_m, 0.0, camera_z_m),
        middle_m,
        place_sigma_m: 0.2e-3,
        size: Some(share),
        size_sigma: 0.005,
        target: GraspTarget { base_from_tcp, jaw_width_m: 0.03 * share, score: 0.9 },
    }
}

fn pair(height_m: f64, plane_m: f64) -> [Sighting; 2] {
    [[0.44, 0.3], [0.56, 0.3]].map(|camera| shown(camera, 0.51, height_m, plane_m))
}

#[test]
fn lines_of_sight_cross_where_the_part_is() {
    for height_m in [-0.01, 0.0, 0.016, 0.08] {
        let [one, other] = pair(height_m, 0.02);
        let found = triangulate(&one, &other, 0.0).unwrap();
        assert!((found.height_m - height_m).abs() < 1e-9, "{found:?}");
        let target = one.at_height(height_m).target;
        assert!((target.base_from_tcp.translation.x - 0.51).abs() < 1e-9, "{target:?}");
        assert!((target.base_from_tcp.translation.z - height_m + 0.005).abs() < 1e-9);
        assert!((target.jaw_width_m - 0.03).abs() < 1e-9);
    }
}

#[test]
fn sigma_is_that_of_the_places_over_the_baseline() {
    // 0.2 mm in each of two pictures from 0.3 m, 0.12 m apart: √2 · 0.2 · 0.3 / 0.12 mm.
    let [one, other] = pair(0.0, 0.0);
    let found = triangulate(&one, &other, 0.0).unwrap();
    assert!((found.sigma_m - 0.707_107e-3).abs() < 1e-8, "{found:?}");
    // A relief of 1 mm adds its variance.
    let found = triangulate(&one, &other, 0.001).unwrap();
    assert!((found.sigma_m - 0.707_107e-3_f64.hypot(1e-3)).abs() < 1e-8, "{found:?}");
    // A longer baseline gives a smaller sigma.
    let wide = triangulate(&shown([0.40, 0.3], 0.5, 0.0, 0.0), &shown([0.60, 0.3], 0.5, 0.0, 0.0), 0.0);
    assert!(wide.unwrap().sigma_m < 0.5e-3);
}

#[test]
fn pictures_that_tell_no_height_are_refused() {
    let at = |x_m: f64, z_m: f64| shown([x_m, z_m], 0.5, 0.0, 0.0);
    let refused = |one: &Sighting, other: &Sighting| triangulate(one, other, 0.0).unwrap_err().to_string();
    // Two pictures from one place, and from two places that are too close together.
    let why = refused(&at(0.5, 0.3), &at(0.5, 0.3));
    assert_eq!(why, "expected two pictures from places at least 80 mm apart sideways, found 0.0 mm");
    assert!(refused(&at(0.5, 0.3), &at(0.579, 0.3)).ends_with("found 79.0 mm"));
    assert!(triangulate(&at(0.46, 0.3), &at(0.541, 0.3), 0.0).is_ok());
    // A vertical distance of 0.6 m is not a sideways distance.
    assert!(refused(&at(0.5, 0.3), &at(0.5, 0.9)).contains("at least 80 mm apart"));
    // Seen from far away, lines of sight are nearly parallel.
    assert!(refused(&at(0.45, 1.2), &at(0.55, 1.2)).starts_with("expected lines of sight whose slopes differ"));
    // Lines of sight that cross 0.75 m above the table, above the cameras: the part appears to move farther than the
    // camera.
    let (mut one, mut other) = (at(0.44, 0.3), at(0.56, 0.3));
    (one.middle_m.x, other.middle_m.x) = (0.40, 0.60);
    assert!(refused(&one, &other).contains("found lines of sight that cross at"));
    let behind = HeightError::BehindCamera { height_m: 0.30, camera_m: 0.30 }.above_table(-0.1).to_string();
    assert!(behind.ends_with("which is 400 mm high, found lines of sight that cross at 400 mm"), "{behind}");
    // A plane too close below the camera.
    assert!(refused(&shown([0.44, 0.3], 0.5, 0.0, 0.29), &at(0.56, 0.3)).contains("below the camera"));
    // Two parts: the lines of sight pass each other 12 mm apart.
    let mut beside = at(0.56, 0.3);
    beside.middle_m.y += 0.012;
    assert!(refused(&at(0.44, 0.3), &beside).contains("within 4.0 mm, found 11.9 mm: two parts"));
    let mut none = at(0.56, 0.3);
    none.middle_m.x = f64::NAN;
    assert_eq!(refused(&at(0.44, 0.3), &none), HeightError::NotFinite.to_string());
}

#[test]
fn of_several_parts_the_pair_is_found_that_is_one_part() {
    // Three parts in a row along the baseline, 25 mm apart: each line of sight crosses all those of the other
    // picture.
    let parts_m = [0.485, 0.51, 0.535];
    let look = |camera_x_m: f64| parts_m.map(|part_x_m| shown([camera_x_m, 0.3], part_x_m, 0.016, 0.02));
    let (ones, mut others) = (look(0.44), look(0.56));
    others.reverse();
    let (height, pair) = triangulate_nearest(&ones, &others, 0.0, |_| Ok(true)).unwrap().unwrap();
    assert!((height.height_m - 0.016).abs() < 1e-6, "{height:?}");
    let apart = pair[0].at_height(height.height_m).middle_m - pair[1].at_height(height.height_m).middle_m;
    assert!(apart.norm() < 1e-9, "{apart}");
    assert!(triangulate_nearest(&[], &others, 0.0, |_| Ok(true)).is_none());
    // Lines of sight to two parts, which fit worse, are chosen if no other pair is near.
    let is_near = |pair: &[Sighting; 2]| Ok((pair[0].middle_m.z - 0.016).abs() > 0.010);
    let (height, _) = triangulate_nearest(&ones, &others, 0.0, is_near).unwrap().unwrap();
    assert!((height.height_m - 0.016).abs() > 0.010, "{height:?}");
    let refused = HeightError::Elsewhere { beside_m: 0.025, score: 0.3 };
    assert_eq!(triangulate_nearest(&ones, &others, 0.0, |_| Err(refused)), Some(Err(refused)));
}

proptest! {
    #[test]
    fn any_two_places_give_the_height(
        left_m in 0.30..0.45f64, right_m in 0.55..0.70f64, camera_m in 0.20..0.30f64, part_m in 0.45..0.55f64, height_m in 0.0..0.1f64,
        plane_m in 0.0..0.1f64,
    ) {
        let [one, other] = [left_m, right_m].map(|x_m| shown([x_m, camera_m], part_m, height_m, plane_m));
        let found = triangulate(&one, &other, 0.0).unwrap();
        prop_assert!((found.height_m - height_m).abs() < 1e-9, "{found:?}");
    }
}

#[test]
fn the_mean_of_two_measurements_is_nearer_to_the_more_certain_one() {
    let at = |height_mm: f64, sigma_mm: f64| MeasuredHeight { height_m: 1e-3 * height_mm, sigma_m: 1e-3 * sigma_mm };
    // Variances of 1 and 4: weights of 0.8 and 0.2.
    let mean = at(10.0, 1.0).mean(&at(15.0, 2.0)).unwrap();
    assert!((mean.height_m - 0.011).abs() < 1e-12 && (mean.sigma_m - 0.8e-3_f64.sqrt() * 1e-3_f64.sqrt()).abs() < 1e-9);
    assert_eq!(at(10.0, 1.0).mean(&at(19.0, 2.0)), None);
}
