//! The likeliest poses of a picture, corrected by where the comparison network finds the demonstration's features.
//!
//! Keypoints on a short grasp line, or a box, say little of where a long part ends.

use image::RgbImage;
use sdg_comparison::{ComparisonNetwork, Pyramid, View};
use sdg_geometry::PlanarSimilarity;

use super::candidate::PoseCandidate;
use super::comparison::Compared;
use crate::taught::TaughtDemonstration;

/// Candidates of an image whose poses are corrected: the likeliest. Chosen for time: each takes two more views.
const MAX_ALIGNED: usize = 4;

/// Corrects the poses of the likeliest candidates by where the network finds the demonstration's features, where they score as
/// high there.
pub(super) async fn align(
    network: &ComparisonNetwork,
    image: &RgbImage,
    demonstrations: &[TaughtDemonstration],
    candidates: &mut [PoseCandidate],
) {
    let picture = Pyramid::new(image);
    let likeliest = candidates.len().min(MAX_ALIGNED);
    let candidates = &mut candidates[..likeliest];
    let reference = |one: &PoseCandidate| demonstrations[one.demonstration_idx].reference(network.config());
    let views: Vec<View> = candidates.iter().map(|one| reference(one).view(&picture, &one.image_from_cutout)).collect();
    let offsets = network.offsets(&views).await;
    let poses: Vec<PlanarSimilarity> = candidates
        .iter()
        .zip(&offsets)
        .map(|(one, offset)| reference(one).corrected(&one.image_from_cutout, offset))
        .collect();
    let views: Vec<View> =
        candidates.iter().zip(&poses).map(|(one, pose)| reference(one).view(&picture, pose)).collect();
    let log_odds = network.compare(&views).await;
    for ((one, pose), log_odds) in candidates.iter_mut().zip(poses).zip(log_odds) {
        let corrected = Compared { image_from_cutout: pose, log_odds };
        let demonstration = &demonstrations[one.demonstration_idx];
        let moved = one.clone().scored(demonstration, image.dimensions(), Some(&vec![corrected]));
        if moved.network_score >= one.network_score {
            *one = moved;
        }
    }
}
