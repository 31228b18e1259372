//! A network's score: the probability of the class, reduced if the heads contradict each other, and reduced or
//! increased by the comparison of the place with the demonstration.
//!
//! Box, keypoints, mask and orientation of a detection are separate estimates of the part's pose, which agree on the
//! part. On another object, the box fits that object, and the demonstration at the pose of the other heads fills little
//! of the box or has an impossible size.

use sdg_geometry::{Angle, BoundingBox, PlanarSimilarity};

use crate::sizes::SizeRange;
use crate::taught::TaughtDemonstration;

/// Weight of ln of the filled fraction relative to the log-odds of the class. For four generated parts taught for 120
/// steps, with ten pictures each, 31 of the 40 pictures scored above all but one of the pictures without the part; with
/// a weight of 0, 28 did (docs/decisions/013-base-weights.md). Other weights were not tried.
const WEIGHT: f64 = 3.0;

/// Weight of the comparison network's log-odds relative to the log-odds of the class. Of the same 40 pictures, the
/// number that scored above every picture without the part was: 22 with a weight of 0, 24 with 0.5 and 1, 27 with 2, 29
/// with 3. The number of correct poses was 35 with weights of 0, 0.5 and 1, and 34 with 2 and 3. The network's output
/// varies more between parts than these four show.
const COMPARISON_WEIGHT: f64 = 2.0;

/// Weight of the similarity of the part's features in the finer views. Measured on 49 pictures with correct poses of
/// the generated parts 9001 to 9003, taught for 60 or 120 steps. The number of these pictures that scored above every
/// picture without the part was: 16 with a weight of 0, 34 with 5, 36 with 10, 37 with 20, 38 with 30 and 50.
const COSINE_WEIGHT: f64 = 20.0;
/// The neutral mean cosine: between the values of other objects, 0.35 to 0.6, and of the part, 0.6 to 0.9.
const NEUTRAL_COSINE: f64 = 0.62;

/// The usual threshold of the score of generated parts, in log-odds. On the parts 9001 to 9004, this value accepts 30
/// of 37 places and 2 of 40 pictures without the part; 1.5 accepts 33 and 4.
#[cfg(feature = "teach")]
pub(crate) const USUAL_THRESHOLD: f64 = 2.0;

/// Minimum filled fraction, so that its logarithm is finite.
const MIN_FILLED: f64 = 0.01;
/// Maximum probability, so that its log-odds are finite.
const MAX_PROBABILITY: f64 = 1.0 - 1e-6;

/// The comparison network's output for a pose.
#[derive(Debug, Clone, Copy)]
pub(super) struct ComparisonEvidence {
    /// Log-odds that the place shows the part.
    pub(super) log_odds: f64,
    /// The mean cosine of the part's features in the finer views; `None` before the comparison in these views.
    pub(super) cosine: Option<f64>,
}

/// The fraction of the box that the demonstration fills at the model's pose, in `[0, 1]`: the intersection over union
/// of the box with the outline's box, whose size is clamped to the part's possible sizes.
pub(super) fn filled(
    demonstration: &TaughtDemonstration,
    image_from_cutout: &PlanarSimilarity,
    bbox: &BoundingBox,
    picture_size: [u32; 2],
) -> f64 {
    let tolerance = &demonstration.check().search.scales;
    let ranges = SizeRange::all(demonstration.marks.photo_size, picture_size, tolerance);
    let scale = image_from_cutout.scale;
    let factor = SizeRange::nearest(&ranges, scale).map_or(scale, |range| range.clamp(scale)) / scale;
    let placed = demonstration.outline(image_from_cutout).bounds();
    let center = placed.center();
    let sized = PlanarSimilarity::about(center, center, Angle::ZERO, factor).compose(image_from_cutout);
    demonstration.outline(&sized).bounds().iou(bbox)
}

/// The score, in `[0, 1]`.
pub(super) fn score(class_probability: f64, filled: f64, compared: Option<ComparisonEvidence>) -> f64 {
    let probability = class_probability.clamp(1.0 - MAX_PROBABILITY, MAX_PROBABILITY);
    let of_class = (probability / (1.0 - probability)).ln();
    let of_heads = of_class + WEIGHT * filled.max(MIN_FILLED).ln();
    // A mean, because a sum would give scores so close to 0 and 1 that they leave no room for a threshold.
    let with = |ComparisonEvidence { log_odds, cosine }| {
        let of_features = cosine.map_or(0.0, |cosine| COSINE_WEIGHT * (cosine - NEUTRAL_COSINE));
        (of_heads + COMPARISON_WEIGHT * log_odds) / (1.0 + COMPARISON_WEIGHT) + of_features
    };
    1.0 / (1.0 + (-compared.map_or(of_heads, with)).exp())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::teach::tests::demonstration;

    #[test]
    fn a_demonstration_that_fills_its_box_leaves_the_score_and_one_beside_it_or_of_another_size_lowers_it() {
        let taught = TaughtDemonstration::new(&demonstration()).unwrap();
        let picture = taught.marks.photo_size.unwrap_or([640, 480]);
        let at = |x: f64, scale: f64| {
            let pivot = taught.marks.bbox.center();
            let moved = pivot + nalgebra::Vector2::new(x, 0.0);
            PlanarSimilarity::about(pivot, moved, Angle::ZERO, scale)
        };
        let around = |pose: &PlanarSimilarity| taught.outline(pose).bounds();
        let pose = at(300.0, 1.1);
        let whole = filled(&taught, &pose, &around(&pose), picture);
        assert!(whole > 0.999, "{whole}");
        assert!((score(0.9, whole, None) - 0.9).abs() < 1e-3);
        let beside = filled(&taught, &at(300.0 + 0.5 * taught.marks.bbox.width(), 1.1), &around(&pose), picture);
        assert!(beside < 0.6 && score(0.9, beside, None) < 0.7, "{beside}");
        // Both heads agree on twice the size, which the part cannot have.
        let large = at(300.0, 2.0);
        let too_large = filled(&taught, &large, &around(&large), picture);
        assert!(too_large < 0.5 && score(0.9, too_large, None) < 0.6, "{too_large}");
        // A place unlike the demonstration lowers the score, a similar one raises it.
        let compared = |log_odds: f64, cosine| Some(ComparisonEvidence { log_odds, cosine });
        let scores = [-3.0, 0.0, 3.0].map(|log_odds| score(0.7, whole, compared(log_odds, None)));
        assert!(scores[0] < 0.2 && scores[1] < score(0.7, whole, None) && scores[2] > 0.9, "{scores:?}");
        // Features as similar as those of other objects lower the score, features of the part raise it.
        let scores = [0.4, NEUTRAL_COSINE, 0.8].map(|cosine| score(0.7, whole, compared(0.0, Some(cosine))));
        assert!(scores[0] < 0.1 && scores[2] > 0.9, "{scores:?}");
        assert_eq!(scores[1], score(0.7, whole, compared(0.0, None)));
        // The score remains finite for a filled fraction of zero and for a probability of 1.
        assert!(score(1.0, 0.0, None) > 0.0 && score(1.0, 1.0, None) < 1.0 && score(0.0, 1.0, None) > 0.0);
    }
}
