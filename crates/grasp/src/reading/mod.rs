//! How each model reads what its network saw: where the demonstration lies in the image.
//!
//! | model | place | turn |
//! |---|---|---|
//! | B | box ([`placing`]) | line through the keypoints |
//! | C | keypoints | keypoints |

mod keypoints;
mod placing;

use nalgebra::Point2;
use sdg_detection::Detections;
use sdg_geometry::{BoundingBox, PlanarGrasp, PlanarSimilarity};

use crate::facts::ModelKind;
use crate::taught::TaughtDemonstration;

/// Candidates looked at in one image. The network rarely has more than two; verification costs time for each.
const MOST_CANDIDATES: usize = 4;
/// Below this the network itself does not believe it.
const LEAST_NETWORK_SCORE: f64 = 0.05;

/// A detection with the model's reading of it, not yet verified.
#[derive(Debug, Clone)]
pub(crate) struct Candidate {
    pub(crate) network_score: f64,
    pub(crate) bbox: BoundingBox,
    /// Each with the network's score; empty where the model has none.
    pub(crate) keypoints: Vec<(Point2<f64>, f64)>,
    pub(crate) grasp: PlanarGrasp,
    /// The demonstration that it is compared with first.
    pub(crate) demonstration_idx: usize,
    /// Where that demonstration lies.
    pub(crate) image_from_cutout: PlanarSimilarity,
}

/// A reading without the detection's own score and box.
struct Reading {
    keypoints: Vec<(Point2<f64>, f64)>,
    grasp: PlanarGrasp,
    demonstration_idx: usize,
    image_from_cutout: PlanarSimilarity,
}

/// Reads the detections of one image, best first. Those that make no sense to the model (keypoints on one place) are
/// left out.
pub(crate) fn candidates(
    kind: ModelKind,
    detections: &Detections,
    demonstrations: &[TaughtDemonstration],
) -> Vec<Candidate> {
    (0..detections.scores.len())
        .filter(|&i| detections.scores[i] >= LEAST_NETWORK_SCORE)
        .take(MOST_CANDIDATES)
        .filter_map(|i| {
            let reading = match kind {
                ModelKind::B => keypoints::turn_and_box(detections, i, demonstrations),
                ModelKind::C => keypoints::line(detections, i, demonstrations),
            }?;
            Some(Candidate {
                network_score: detections.scores[i],
                bbox: detections.boxes[i],
                keypoints: reading.keypoints,
                grasp: reading.grasp,
                demonstration_idx: reading.demonstration_idx,
                image_from_cutout: reading.image_from_cutout,
            })
        })
        .collect()
}

/// The demonstration that, where `pose` puts it, fills the detected box best.
fn nearest_demonstration(
    demonstrations: &[TaughtDemonstration],
    bbox: &BoundingBox,
    pose: impl Fn(&TaughtDemonstration) -> Option<PlanarSimilarity>,
) -> Option<(usize, PlanarSimilarity)> {
    demonstrations
        .iter()
        .enumerate()
        .filter_map(|(i, demonstration)| {
            let pose = pose(demonstration)?;
            Some((i, pose, demonstration.outline(&pose).bounds().iou(bbox)))
        })
        .max_by(|a, b| a.2.total_cmp(&b.2))
        .map(|(i, pose, _)| (i, pose))
}
