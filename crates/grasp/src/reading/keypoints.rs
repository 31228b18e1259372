//! Models B and C: keypoints along the grasp line.

use nalgebra::Point2;
use sdg_detection::Detections;
use sdg_geometry::{Angle, Keypoint, PlanarGrasp, PlanarSimilarity};

use super::placing::fill_box;
use super::{Reading, nearest_demonstration};
use crate::taught::TaughtDemonstration;

/// Model C: the keypoints' mean is the grasp's middle, the least-squares line through them its angle.
///
/// # Source
/// Paper, section IV-C.
pub(super) fn line(detections: &Detections, i: usize, demonstrations: &[TaughtDemonstration]) -> Option<Reading> {
    let keypoints = scored(detections, i);
    let (demonstration_idx, image_from_cutout) =
        nearest_demonstration(demonstrations, &detections.boxes[i], |d| pose_from_keypoints(d, &keypoints))?;
    let width = demonstrations[demonstration_idx].marks.width_px * image_from_cutout.scale;
    let grasp = PlanarGrasp::from_keypoints(&visible(&keypoints), width)?;
    Some(Reading { keypoints, grasp, demonstration_idx, image_from_cutout })
}

/// Model B: the box gives the place, the keypoints the turn alone.
///
/// # Source
/// Paper, section IV-B. There the box's middle is the grasp; here the grasp keeps the taught offset from it.
pub(super) fn turn_and_box(
    detections: &Detections,
    i: usize,
    demonstrations: &[TaughtDemonstration],
) -> Option<Reading> {
    let keypoints = scored(detections, i);
    let angle = PlanarGrasp::from_keypoints(&visible(&keypoints), 0.0)?.angle;
    let bbox = &detections.boxes[i];
    let (demonstration_idx, image_from_cutout) = nearest_demonstration(demonstrations, bbox, |demonstration| {
        let turn = angle.radians() - demonstration.marks.grasp.angle().radians();
        Some(fill_box(demonstration, bbox, Angle::from_radians(turn)))
    })?;
    let grasp = demonstrations[demonstration_idx].grasp(&image_from_cutout);
    Some(Reading { keypoints, grasp, demonstration_idx, image_from_cutout })
}

fn scored(detections: &Detections, i: usize) -> Vec<(Point2<f64>, f64)> {
    detections.keypoints[i].iter().map(|k| (Point2::new(k.x, k.y), k.score)).collect()
}

fn visible(keypoints: &[(Point2<f64>, f64)]) -> Vec<Keypoint> {
    keypoints.iter().map(|(point, _)| Keypoint::visible(*point)).collect()
}

/// Where the demonstration lies in an image, as keypoints say.
fn pose_from_keypoints(
    demonstration: &TaughtDemonstration,
    keypoints: &[(Point2<f64>, f64)],
) -> Option<PlanarSimilarity> {
    let from: Vec<_> = demonstration.keypoints().iter().map(|k| k.point()).collect();
    let to: Vec<_> = keypoints.iter().map(|(point, _)| *point).collect();
    PlanarSimilarity::fit(&from, &to)
}
