//! Models B and C: keypoints along the grasp line.

use nalgebra::Point2;
use sdg_detection::Detections;
use sdg_geometry::{BoundingBox, Keypoint, PlanarGrasp, PlanarSimilarity};

use super::placing::{PoseReading, fill_box, nearest_demonstration};
use crate::facts::TurnSource;
use crate::taught::TaughtDemonstration;

/// The keypoints of one detection, each with the network's score; none without a keypoint head.
pub(super) fn scored(detections: &Detections, i: usize) -> Vec<(Point2<f64>, f64)> {
    detections.keypoints[i].iter().map(|k| (Point2::new(k.x, k.y), k.score)).collect()
}

/// Model C: the keypoints give the pose of the demonstration.
pub(super) fn on_line(
    keypoints: &[(Point2<f64>, f64)],
    bbox: &BoundingBox,
    demonstrations: &[TaughtDemonstration],
) -> Option<PoseReading> {
    let seen: Vec<Point2<f64>> = keypoints.iter().map(|(point, _)| *point).collect();
    nearest_demonstration(demonstrations, bbox, |_, demonstration| {
        let taught: Vec<Point2<f64>> = demonstration.keypoints().iter().map(|k| k.point()).collect();
        Some((PlanarSimilarity::fit(&taught, &seen)?, TurnSource::Keypoints))
    })
}

/// The mean of the keypoints is the centre of the grasp, and the least-squares line through them gives the angle.
/// `None` if all keypoints coincide.
///
/// # Source
/// Paper, section IV-C.
pub(super) fn grasp(keypoints: &[(Point2<f64>, f64)], width_px: f64) -> Option<PlanarGrasp> {
    let visible: Vec<Keypoint> = keypoints.iter().map(|(point, _)| Keypoint::visible(*point)).collect();
    PlanarGrasp::from_keypoints(&visible, width_px)
}

/// Model B: the box gives the position, the keypoints only the orientation.
///
/// # Source
/// Paper, section IV-B. In the paper the box's centre is the grasp; here the grasp keeps the taught offset from that
/// centre.
pub(super) fn box_and_turn(
    keypoints: &[(Point2<f64>, f64)],
    bbox: &BoundingBox,
    demonstrations: &[TaughtDemonstration],
) -> Option<PoseReading> {
    let angle = grasp(keypoints, 0.0)?.angle;
    nearest_demonstration(demonstrations, bbox, |_, demonstration| {
        Some((fill_box(demonstration, bbox, angle), TurnSource::Keypoints))
    })
}
