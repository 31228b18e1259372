//! Further matches near the positions predicted by a known pose.
//!
//! The ratio test rejects correct matches of repeated texture. With a known pose, a keypoint of the template is
//! searched only at its predicted position, by a kd-tree over the image's keypoints.

use kiddo::{ImmutableKdTree, SquaredEuclidean};
use nalgebra::Point2;
use sdg_geometry::PlanarSimilarity;

use crate::matching::distance;
use crate::{Features, RansacConfig};

/// Maximum distance of the descriptors of a match: descriptors of correct matches are seldom farther apart, and
/// unrelated ones are seldom closer.
const MAX_DESCRIPTOR_DISTANCE: f32 = 0.7;

/// Pairs of indices, in the template and in the image, of features that coincide at the pose, agree in
/// direction and scale, and look alike.
pub(crate) fn matches_at_pose(
    template: &Features,
    image: &Features,
    image_from_template: &PlanarSimilarity,
    config: &RansacConfig,
) -> Vec<(usize, usize)> {
    let places: Vec<[f64; 2]> = image.keypoints.iter().map(|k| [k.position.x, k.position.y]).collect();
    let Ok(tree) = ImmutableKdTree::<f64, 2>::new_from_slice(&places) else { return Vec::new() };
    let mut found = Vec::new();
    for (i, keypoint) in template.keypoints.iter().enumerate() {
        let expected: Point2<f64> = image_from_template.apply(&keypoint.position);
        let sigma = keypoint.sigma * image_from_template.scale;
        let angle = keypoint.angle + image_from_template.angle;
        let radius = config.tolerance_px.max(sigma);
        let near = tree.query(&[expected.x, expected.y]).within::<SquaredEuclidean<f64>>(radius * radius).execute();
        let fits = near.iter().map(|hit| hit.item as usize).filter(|&j| {
            let candidate = &image.keypoints[j];
            let factor = candidate.sigma / sigma;
            candidate.angle.distance(angle) <= config.max_turn_difference
                && factor.max(1.0 / factor) <= config.max_scale_factor
        });
        let look = |j: usize| distance(&template.descriptors[i], &image.descriptors[j]);
        let best = fits.map(|j| (look(j), j)).min_by(|a, b| a.0.total_cmp(&b.0));
        if let Some((_, j)) = best.filter(|&(distance, _)| distance <= MAX_DESCRIPTOR_DISTANCE) {
            found.push((i, j));
        }
    }
    found
}
