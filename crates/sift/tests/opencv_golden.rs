//! Compares keypoints and descriptors with those of OpenCV 5.0.0 (`compare/write_golden.py`).

use crate::support;
use sdg_sift::{DescriptorNormalization, Plane, Sift, SiftConfig};

/// The default settings with a change.
fn with(change: impl FnOnce(&mut SiftConfig)) -> SiftConfig {
    let mut config = SiftConfig::default();
    change(&mut config);
    config
}

const LEFT: u32 = 240;
const TOP: u32 = 150;
const WIDTH: u32 = 170;
const HEIGHT: u32 = 150;

struct Golden {
    place: [f32; 2],
    sigma: f32,
    degrees: f32,
    descriptor: Vec<f32>,
}

fn golden() -> Vec<Golden> {
    let bytes = include_bytes!("golden/pendulum.bin");
    let record = |record: &[u8]| {
        let float = |i: usize| f32::from_le_bytes(record[4 * i..4 * i + 4].try_into().unwrap());
        let descriptor = record[16..].iter().map(|&byte| f32::from(byte)).collect();
        Golden { place: [float(0), float(1)], sigma: float(2), degrees: float(3), descriptor }
    };
    bytes.chunks_exact(144).map(record).collect()
}

/// OpenCV's directions have y pointing up, so its eight directions have the opposite order.
fn cosine_with_opencv(ours: &[f32], theirs: &[f32]) -> f32 {
    let mirrored = |i: usize| i - i % 8 + (8 - i % 8) % 8;
    let dot: f32 = (0..ours.len()).map(|i| ours[i] * theirs[mirrored(i)]).sum();
    let length = |v: &[f32]| v.iter().map(|x| x * x).sum::<f32>().sqrt();
    dot / (length(ours) * length(theirs))
}

#[test]
fn keypoints_and_descriptors_are_those_of_opencv() {
    let picture =
        Plane::from_rgb(&image::imageops::crop_imm(&support::picture("pendulum"), LEFT, TOP, WIDTH, HEIGHT).to_image());
    let config = with(|config| config.normalization = DescriptorNormalization::Clipped);
    let features = Sift::new(config).unwrap().detect_and_describe(&picture, None).unwrap();
    let golden = golden();
    assert!(golden.len() > 30, "{} golden keypoints", golden.len());

    let mut same_place = 0;
    let mut cosines = Vec::new();
    for expected in &golden {
        let at_place = features.keypoints.iter().enumerate().filter(|(_, k)| {
            // OpenCV and this crate compute in 32 bits, in a different order.
            let apart =
                (k.position.x - f64::from(expected.place[0])).hypot(k.position.y - f64::from(expected.place[1]));
            apart < 0.01 && (k.sigma / f64::from(expected.sigma) - 1.0).abs() < 0.005
        });
        same_place += usize::from(at_place.clone().next().is_some());
        // OpenCV adds a sample to the nearest of 36 bins, this crate to the two nearest: directions differ by a
        // fraction of a bin.
        let turned = |k: &sdg_sift::SiftKeypoint| {
            k.angle.distance(sdg_geometry::Angle::from_degrees(f64::from(expected.degrees))).to_degrees()
        };
        let same = at_place.filter(|(_, k)| turned(k) < 5.0).map(|(i, _)| i).next();
        cosines.extend(same.map(|i| cosine_with_opencv(&features.descriptors[i], &expected.descriptor)));
    }
    cosines.sort_by(f32::total_cmp);
    println!(
        "{} golden, {same_place} at the same place, {} at the same angle, cosines {cosines:?}",
        golden.len(),
        cosines.len()
    );
    // One keypoint may be so close to a threshold that rounding decides.
    assert!(same_place + 1 >= golden.len(), "{same_place} of {} places", golden.len());
    assert!(cosines.len() * 10 >= golden.len() * 9, "{} of {} directions", cosines.len(), golden.len());
    // OpenCV centres its grid on the nearest pixel, this crate on the keypoint.
    assert!(cosines[cosines.len() / 2] > 0.99 && cosines[0] > 0.95, "{cosines:?}");
}
