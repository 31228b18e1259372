//! The comparison network's part in a detection: whether what lies under a pose looks like the demonstration.
//!
//! A part whose two ends are alike is often read the wrong way round, and keypoints on a short grasp line say little of where
//! a long part ends. So the pose that a model read is compared as it is, and laid into the detected box in its direction
//! and in the opposite one.

use image::RgbImage;
use sdg_comparison::{ComparisonNetwork, Pyramid};
use sdg_geometry::{Angle, BoundingBox, PlanarSimilarity};

use super::placing::fill_box;
use crate::taught::TaughtDemonstration;

/// A pose and the log-odds that the part lies so.
#[derive(Debug, Clone, Copy)]
pub(super) struct Compared {
    pub(super) image_from_cutout: PlanarSimilarity,
    pub(super) log_odds: f64,
}

/// Compares the poses that each detection may have, given with its demonstration, its box, its grasp's angle and its pose; the
/// one that was read first.
pub(super) async fn compared(
    network: &ComparisonNetwork,
    image: &RgbImage,
    detections: impl Iterator<Item = (&TaughtDemonstration, &BoundingBox, Angle, PlanarSimilarity)>,
) -> Vec<Vec<Compared>> {
    let picture = Pyramid::new(image);
    let (mut views, mut poses) = (Vec::new(), Vec::new());
    for (demonstration, bbox, grasp_angle, pose) in detections {
        let likely = likely_poses(demonstration, bbox, grasp_angle, pose);
        let reference = demonstration.reference(network.config());
        views.extend(likely.iter().map(|pose| reference.view(&picture, pose)));
        poses.push(likely);
    }
    let mut log_odds = network.compare(&views).await.into_iter();
    let mut with_odds = |likely: Vec<PlanarSimilarity>| {
        likely
            .into_iter()
            .zip(log_odds.by_ref())
            .map(|(image_from_cutout, log_odds)| Compared { image_from_cutout, log_odds })
            .collect()
    };
    poses.into_iter().map(&mut with_odds).collect()
}

/// The pose that was read; laid into the box where that is another; laid into it the other way round.
fn likely_poses(
    demonstration: &TaughtDemonstration,
    bbox: &BoundingBox,
    grasp_angle: Angle,
    image_from_cutout: PlanarSimilarity,
) -> Vec<PlanarSimilarity> {
    /// Share of the box's diagonal by which the same point may be apart in two poses that are taken for one.
    const MAX_DISTANCE: f64 = 0.01;
    let laid = fill_box(demonstration, bbox, grasp_angle);
    let opposite = fill_box(demonstration, bbox, grasp_angle + Angle::from_degrees(180.0));
    let marked = demonstration.marks.bbox;
    let is_read = [(marked.x1, marked.y1), (marked.x2, marked.y2)].into_iter().all(|(x, y)| {
        let corner = nalgebra::Point2::new(x, y);
        let apart = (laid.apply(&corner) - image_from_cutout.apply(&corner)).norm();
        apart <= MAX_DISTANCE * bbox.width().hypot(bbox.height())
    });
    if is_read { vec![image_from_cutout, opposite] } else { vec![image_from_cutout, laid, opposite] }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::teach::tests::demonstration;
    use nalgebra::Point2;

    #[test]
    fn both_directions_fill_the_box_and_what_was_read_comes_first() {
        let taught = TaughtDemonstration::new(&demonstration()).unwrap();
        let (from, to) = (taught.marks.bbox.center(), Point2::new(200.0, 140.0));
        let pose = PlanarSimilarity::about(from, to, Angle::from_degrees(33.0), 1.1);
        let bbox = taught.outline(&pose).bounds();
        let grasp_angle = taught.grasp(&pose).angle;
        let likely = likely_poses(&taught, &bbox, grasp_angle, pose);
        assert_eq!((likely.len(), likely[0]), (2, pose));
        assert!(taught.outline(&likely[1]).bounds().iou(&bbox) > 0.999);
        assert!((likely[1].angle.distance(pose.angle).to_degrees() - 180.0).abs() < 1e-9);
        // Read too small, it is laid into its box as well.
        let small = PlanarSimilarity::about(from, to, Angle::from_degrees(33.0), 0.8);
        let likely = likely_poses(&taught, &bbox, grasp_angle, small);
        assert_eq!((likely.len(), likely[0]), (3, small));
        assert!((likely[1].apply(&from) - pose.apply(&from)).norm() < 1e-6 && (likely[1].scale - 1.1).abs() < 1e-9);
    }
}
