//! The comparison network's part in a detection: whether what lies under a pose looks like the demonstration, and whether it
//! looks more like it after half a turn.
//!
//! A part whose two ends are alike is often read the wrong way round, and its box fits both ways. So each pose is compared
//! as it is and turned by 180° about the middle of its box.

use image::RgbImage;
use sdg_comparison::ComparisonNetwork;
use sdg_geometry::{Angle, PlanarSimilarity};

use crate::taught::TaughtDemonstration;

/// The likelier of a pose and its half turn.
pub(super) struct Compared {
    /// That the part lies so.
    pub(super) log_odds: f64,
    /// The half turn, where it is the likelier one.
    pub(super) half_turned: Option<PlanarSimilarity>,
}

/// Compares each pose, given with its demonstration.
pub(super) async fn compared(
    network: &ComparisonNetwork,
    image: &RgbImage,
    poses: impl Iterator<Item = (&TaughtDemonstration, PlanarSimilarity)>,
) -> Vec<Compared> {
    let input_px = network.config().input_px;
    let (mut views, mut half_turns) = (Vec::new(), Vec::new());
    for (demonstration, pose) in poses {
        let half_turned = half_turned(demonstration, &pose);
        let reference = demonstration.reference(input_px);
        views.extend([&pose, &half_turned].map(|pose| reference.view(image, pose)));
        half_turns.push(half_turned);
    }
    let log_odds = network.compare(&views).await;
    let likelier = |(both, half_turned): (&[f64], PlanarSimilarity)| Compared {
        log_odds: both[0].max(both[1]),
        half_turned: (both[1] > both[0]).then_some(half_turned),
    };
    log_odds.chunks_exact(2).zip(half_turns).map(likelier).collect()
}

/// A pose turned by 180° about the middle of the box that the demonstration fills under it.
fn half_turned(demonstration: &TaughtDemonstration, image_from_cutout: &PlanarSimilarity) -> PlanarSimilarity {
    let center = demonstration.outline(image_from_cutout).bounds().center();
    PlanarSimilarity::about(center, center, Angle::from_degrees(180.0), 1.0).compose(image_from_cutout)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::teach::tests::demonstration;
    use nalgebra::Point2;

    #[test]
    fn half_a_turn_keeps_the_box_and_two_of_them_the_pose() {
        let taught = TaughtDemonstration::new(&demonstration()).unwrap();
        let (from, to) = (taught.marks.bbox.center(), Point2::new(200.0, 140.0));
        let pose = PlanarSimilarity::about(from, to, Angle::from_degrees(33.0), 1.1);
        let turned = half_turned(&taught, &pose);
        let [one, other] = [&pose, &turned].map(|pose| taught.outline(pose).bounds());
        assert!(one.iou(&other) > 0.999, "{one:?} {other:?}");
        assert!((turned.angle.distance(pose.angle).to_degrees() - 180.0).abs() < 1e-9);
        let corner = Point2::new(3.0, 5.0);
        assert!((half_turned(&taught, &turned).apply(&corner) - pose.apply(&corner)).norm() < 1e-9);
    }
}
