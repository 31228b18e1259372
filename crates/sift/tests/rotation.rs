//! Tests the rotation of the repository's parts relative to their demonstrations.

use crate::support;
use nalgebra::Point2;
use sdg_geometry::{Angle, Mask, PlanarSimilarity, Polygon};
use sdg_sift::{Plane, RotationConfig, RotationEstimator, RotationMethod, Sift, SiftError};
use support::{PARTS, mask, outline, picture, relit, warped};

fn estimator() -> RotationEstimator {
    RotationEstimator::new(Sift::default(), RotationConfig::default()).unwrap()
}

fn pose(outline: &Polygon, degrees: f64, scale: f64, x: f64, y: f64) -> PlanarSimilarity {
    PlanarSimilarity::about(outline.centroid(), Point2::new(x, y), Angle::from_degrees(degrees), scale)
}

/// Adds noise as strong as the table's, so that the view is not only the resampled template.
fn grainy(image: &Plane) -> Plane {
    Plane::from_fn(image.width() as u32, image.height() as u32, |x, y| {
        let mixed = (u64::from(x) << 20 | u64::from(y)).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 40;
        image.row(y as usize)[x as usize] + 0.02 * (mixed as f32 / (1u64 << 24) as f32 - 0.5)
    })
}

#[test]
fn texture_tells_the_turn_of_every_part() {
    let estimator = estimator();
    let (mut features, mut total, mut worst) = (0, 0, 0.0f64);
    for part in PARTS {
        let (image, outline) = (Plane::from_rgb(&picture(part)), outline(part));
        let template = estimator.template(&image, Some(&mask(&outline, &image))).unwrap();
        for (i, degrees) in [-170.0, -95.0, 15.0, 125.0].into_iter().enumerate() {
            let scale = [1.0, 0.85, 1.2][i % 3];
            let truth = pose(&outline, degrees, scale, 280.0 + 15.0 * i as f64, 200.0 + 10.0 * i as f64);
            let seen = warped(&image, &truth, 640, 480);
            let seen = grainy(&relit(&seen, |v, x, y| v * (0.6 + 0.3 * x) + 0.1 * y));
            let seen_mask = mask(&outline.transformed(&truth), &seen);
            let found = estimator.estimate(&template, &seen, Some(&seen_mask)).unwrap().expect("the part is there");
            let error = found.angle.distance(truth.angle).to_degrees();
            println!("{part} {degrees} x{scale}: {error:.2} degrees off, {:?}", found.method);
            assert!(error < 1.5, "{part} at {degrees}: {error} degrees off, {found:?}");
            assert!((found.image_from_template.scale / scale - 1.0).abs() < 0.03);
            assert!(found.overlap.unwrap() > 0.85);
            features += usize::from(matches!(found.method, RotationMethod::Features { .. }));
            (total, worst) = (total + 1, worst.max(error));
        }
    }
    println!("{features} of {total} by features, worst {worst:.2} degrees");
    assert!(features * 10 >= total * 9, "{features} of {total} by features");
}

#[test]
fn without_masks_the_whole_image_is_searched() {
    let estimator = estimator();
    for part in PARTS {
        let (image, outline) = (Plane::from_rgb(&picture(part)), outline(part));
        let template = estimator.template(&image, Some(&mask(&outline, &image))).unwrap();
        let truth = pose(&outline, 100.0, 1.0, 350.0, 260.0);
        let found = estimator.estimate(&template, &warped(&image, &truth, 640, 480), None).unwrap();
        let found = found.unwrap_or_else(|| panic!("{part} is there"));
        assert!(found.angle.distance(truth.angle).to_degrees() < 1.0, "{part}: {found:?}");
        assert_eq!(found.overlap, None);
    }
}

#[test]
fn outlines_tell_the_turn_where_texture_is_missing() {
    let estimator = estimator();
    for part in PARTS {
        let outline = outline(part);
        // The part in one flat tone, barely brighter than a flat table.
        let flat = |outline: &Polygon| {
            let mask = outline.rasterize(640, 480);
            (Plane::from_fn(640, 480, |x, y| if mask.get(x, y) { 0.505 } else { 0.5 }), mask)
        };
        let (image, part_mask) = flat(&outline);
        let template = estimator.template(&image, Some(&part_mask)).unwrap();
        for degrees in [-150.0, -75.0, 20.0, 110.0] {
            let truth = pose(&outline, degrees, 1.1, 300.0, 250.0);
            let (seen, seen_mask) = flat(&outline.transformed(&truth));
            let found = estimator.estimate(&template, &seen, Some(&seen_mask)).unwrap().unwrap();
            assert!(matches!(found.method, RotationMethod::Silhouette { .. }), "{found:?}");
            let error = found.angle.distance(truth.angle).to_degrees();
            println!("{part} {degrees}: {error:.2} degrees off, {found:?}");
            // The rod end looks nearly the same after a rotation by 180°; an unreliable estimate must be
            // marked as ambiguous.
            assert!(error < 1.0 || found.is_ambiguous(), "{part} at {degrees}: {error} degrees off, {found:?}");
            assert!(found.overlap.unwrap() > 0.9);
        }
    }
}

#[test]
fn masks_serve_as_binary_images() {
    let estimator = estimator();
    for part in PARTS {
        let outline = outline(part);
        let part_mask = outline.rasterize(640, 480);
        let template = estimator.template(&Plane::from_mask(&part_mask), Some(&part_mask)).unwrap();
        for degrees in [-120.0, 45.0, 165.0] {
            let truth = pose(&outline, degrees, 1.0, 330.0, 240.0);
            let seen = outline.transformed(&truth).rasterize(640, 480);
            let found = estimator.estimate(&template, &Plane::from_mask(&seen), Some(&seen)).unwrap().unwrap();
            let error = found.angle.distance(truth.angle).to_degrees();
            println!("{part} {degrees}: {error:.2} degrees off, {:?}", found.method);
            assert!(error < 2.0 || found.is_ambiguous(), "{part} at {degrees}: {error} degrees off, {found:?}");
        }
    }
}

#[test]
fn what_is_not_there_is_not_found() {
    let estimator = estimator();
    let (image, outline) = (Plane::from_rgb(&picture("pendulum")), outline("pendulum"));
    let template = estimator.template(&image, Some(&mask(&outline, &image))).unwrap();
    let blank = Plane::from_fn(640, 480, |_, _| 0.6);
    assert_eq!(estimator.estimate(&template, &blank, None).unwrap(), None);
    assert_eq!(estimator.estimate(&template, &blank, Some(&Mask::empty(640, 480))).unwrap(), None);
    let dot = Plane::from_fn(1, 1, |_, _| 0.6);
    assert_eq!(estimator.estimate(&template, &dot, None).unwrap(), None);
    for other in ["fuel_line", "rod_end"] {
        // Only the other part itself, because the table and the arm's shadow are the same in all pictures.
        let (seen, outline) = (Plane::from_rgb(&picture(other)), support::outline(other));
        let found = estimator.estimate(&template, &seen, Some(&mask(&outline, &seen))).unwrap();
        let by_features = found.filter(|f| matches!(f.method, RotationMethod::Features { .. }));
        assert_eq!(by_features, None, "{other} taken for a pendulum");
    }
}

#[test]
fn a_bare_template_is_refused() {
    let blank = Plane::from_fn(100, 100, |_, _| 0.6);
    let error = estimator().template(&blank, None).err().unwrap();
    assert_eq!(error, SiftError::BareTemplate { expected: 3, found: 0 });
    let error = estimator().template(&blank, Some(&Mask::empty(3, 3))).err().unwrap();
    assert!(matches!(error, SiftError::MaskSize { .. }));
}
