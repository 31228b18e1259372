//! The comparison network's part in a score: whether what lies under a pose looks like the demonstration.

use image::RgbImage;
use sdg_comparison::ComparisonNetwork;
use sdg_geometry::PlanarSimilarity;

use crate::taught::TaughtDemonstration;

/// The network's log-odds of each pose, given with its demonstration.
pub(super) async fn compared(
    network: &ComparisonNetwork,
    image: &RgbImage,
    poses: impl Iterator<Item = (&TaughtDemonstration, PlanarSimilarity)>,
) -> Vec<f64> {
    let input_px = network.config().input_px;
    let views: Vec<_> =
        poses.map(|(demonstration, pose)| demonstration.reference(input_px).view(image, &pose)).collect();
    network.compare(&views).await
}
