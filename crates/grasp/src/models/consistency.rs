//! A network's score: the probability of the class, less where its heads contradict each other.
//!
//! Box, keypoints, mask and turn of a detection each say where the part lies. On the part they agree; on another thing the
//! box fits that thing, and where the other heads put the demonstration, it fills little of the box or has an impossible size.

use sdg_geometry::{Angle, BoundingBox, PlanarSimilarity};

use crate::sizes::SizeRange;
use crate::taught::TaughtDemonstration;

/// Weight of ln of the share that is filled against the log-odds of the class.
fn weight() -> f64 {
    std::env::var("SDG_W").map_or(3.0, |t| t.parse().unwrap())
}

/// Least share that is filled and most that the odds are, so that both logarithms are finite.
const MIN_FILLED: f64 = 0.01;
const MAX_PROBABILITY: f64 = 1.0 - 1e-6;

/// How much of the box the demonstration fills where the model puts it, in `[0, 1]`: the intersection over the union of the
/// box with that of the outline, which is made no larger and no smaller than the part may be.
pub(super) fn filled(
    demonstration: &TaughtDemonstration,
    image_from_cutout: &PlanarSimilarity,
    bbox: &BoundingBox,
    (width, height): (u32, u32),
) -> f64 {
    let tolerance = &demonstration.check().search.scales;
    let ranges = SizeRange::all(demonstration.marks.photo_size, [width, height], tolerance);
    let scale = image_from_cutout.scale;
    let nearest = ranges.iter().min_by(|a, b| a.distance(scale).total_cmp(&b.distance(scale)));
    let factor = nearest.map_or(scale, |range| range.clamp(scale)) / scale;
    let placed = demonstration.outline(image_from_cutout).bounds();
    let center = placed.center();
    let sized = PlanarSimilarity::about(center, center, Angle::ZERO, factor).compose(image_from_cutout);
    demonstration.outline(&sized).bounds().iou(bbox)
}

/// The score, in `[0, 1]`.
pub(super) fn score(class_probability: f64, filled: f64) -> f64 {
    let probability = class_probability.min(MAX_PROBABILITY);
    let odds = probability / (1.0 - probability) * filled.max(MIN_FILLED).powf(weight());
    odds / (1.0 + odds)
}
