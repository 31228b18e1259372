//! Tests empty pictures, settings out of range, and repeatable results.

use crate::support;
use sdg_geometry::Mask;
use sdg_sift::{Features, Plane, Sift, SiftConfig, SiftError, match_features};
use support::with;

fn describe(image: &Plane) -> Features {
    Sift::default().detect_and_describe(image, None).unwrap()
}

/// Noise without any blur.
fn noise(width: u32, height: u32) -> Plane {
    Plane::from_fn(width, height, |x, y| {
        let mixed = (u64::from(x) << 32 | u64::from(y)).wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        ((mixed ^ (mixed >> 29)).wrapping_mul(0xbf58_476d_1ce4_e5b9) >> 40) as f32 / (1u64 << 24) as f32
    })
}

#[test]
fn empty_tiny_and_flat_pictures_have_no_features() {
    for (width, height) in [(0, 0), (0, 5), (1, 1), (1, 300), (2, 2), (5, 5)] {
        assert!(describe(&noise(width, height)).is_empty(), "{width} × {height}");
    }
    for level in [0.0, 0.5, 1.0] {
        assert!(describe(&Plane::from_fn(200, 150, |_, _| level)).is_empty());
    }
}

#[test]
fn every_number_is_finite_and_every_descriptor_has_unit_length() {
    // The thinnest pictures that have room for extrema, and one of many octaves; noise, and values out of range.
    let wild = |width, height| {
        let plain = noise(width, height);
        Plane::from_fn(width, height, |x, y| 1e3 * (plain.row(y as usize)[x as usize] - 0.5))
    };
    let mut seen = 0;
    for image in [noise(6, 6), noise(7, 90), noise(23, 8), noise(200, 160), wild(60, 50)] {
        let features = describe(&image);
        assert_eq!(features.keypoints.len(), features.descriptors.len());
        seen += features.len();
        for (k, descriptor) in features.keypoints.iter().zip(&features.descriptors) {
            assert!(k.position.x > 0.0 && k.position.x < image.width() as f64);
            assert!(k.position.y > 0.0 && k.position.y < image.height() as f64);
            assert!(k.sigma > 0.5 && k.sigma.is_finite() && k.contrast.is_finite());
            let length: f32 = descriptor.iter().map(|v| v * v).sum();
            assert!((length - 1.0).abs() < 1e-4 && descriptor.iter().all(|v| *v >= 0.0));
        }
    }
    assert!(seen > 100, "{seen} features");
}

#[test]
fn nothing_matches_nothing() {
    let (none, some) = (Features::default(), describe(&noise(64, 64)));
    assert!(some.len() > 2);
    for (a, b) in [(&none, &none), (&none, &some), (&some, &none)] {
        assert_eq!(match_features(a, b, 0.8), []);
    }
    let itself = match_features(&some, &some, 0.8);
    assert!(itself.iter().all(|m| m.query_idx == m.train_idx && m.distance == 0.0 && m.ratio == 0.0));
    assert!(itself.len() * 10 >= some.len() * 9);
}

#[test]
fn the_number_of_threads_changes_no_bit() {
    let image = Plane::from_rgb(&support::picture("pendulum"));
    let with_threads = |n: usize| {
        rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap().install(|| {
            let features = describe(&image);
            let matches = match_features(&features, &features, 0.9);
            (features, matches)
        })
    };
    assert_eq!(with_threads(1), with_threads(3));
}

#[test]
fn a_mask_keeps_what_lies_inside() {
    let image = noise(120, 90);
    let mask = Mask::from_fn(120, 90, |x, _| x < 40);
    let all = describe(&image);
    let inside = Sift::default().detect_and_describe(&image, Some(&mask)).unwrap();
    let expected: Vec<_> = all.keypoints.iter().filter(|k| k.position.x < 40.0).collect();
    assert_eq!(inside.keypoints.iter().collect::<Vec<_>>(), expected);
    assert!(inside.len() > 10 && inside.len() < all.len());
    let wrong = Sift::default().detect_and_describe(&image, Some(&Mask::empty(90, 120))).unwrap_err();
    assert_eq!(wrong.to_string(), "expected a mask of 120 × 90 pixels, the size of its image, found 90 × 120");
}

#[test]
fn the_strongest_are_kept() {
    let image = noise(120, 90);
    let sift = Sift::new(with(|config| config.max_features = Some(25))).unwrap();
    let few = sift.detect_and_describe(&image, None).unwrap();
    assert_eq!(few.len(), 25);
    let weakest = few.keypoints.iter().map(|k| k.contrast).fold(f64::MAX, f64::min);
    let all = describe(&image);
    assert!(all.keypoints.iter().filter(|k| k.contrast > weakest).count() <= 25);
}

#[test]
fn settings_out_of_range_are_named() {
    let error = |config: SiftConfig| Sift::new(config).err().unwrap().to_string();
    assert_eq!(error(with(|config| config.intervals = 0)), "expected intervals from 1 to 16, found 0");
    assert_eq!(
        error(with(|config| config.contrast_threshold = f64::NAN)),
        "expected contrast_threshold at least 0, found NaN"
    );
    assert!(matches!(
        Sift::new(with(|config| config.edge_ratio = 0.5)),
        Err(SiftError::BadSetting { name: "edge_ratio", .. })
    ));
}
