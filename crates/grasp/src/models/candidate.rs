//! A network's candidates: boxes in an image, each converted to a pose of a demonstration.

use nalgebra::Point2;
use sdg_geometry::{BoundingBox, PlanarGrasp, PlanarSimilarity};

use super::consistency::{self, ComparisonEvidence};
use crate::facts::TurnSource;
use crate::same_part::SAME_PART_IOU;
use crate::taught::TaughtDemonstration;

/// The output of a network for an image, converted to poses.
#[derive(Debug, Clone, Default)]
pub(crate) struct Proposals {
    /// The candidates, best first; detections that give no pose are left out.
    pub(crate) candidates: Vec<PoseCandidate>,
    /// All boxes with their scores, also boxes without a candidate.
    pub(super) boxes: Vec<(BoundingBox, f64)>,
}

impl Proposals {
    /// The highest score of a box about the same part as `bbox`; 0 if there is none.
    pub(crate) fn score_at(&self, bbox: &BoundingBox) -> f64 {
        let about_it = self.boxes.iter().filter(|(proposed, _)| proposed.iou(bbox) >= SAME_PART_IOU);
        about_it.map(|(_, score)| *score).fold(0.0, f64::max)
    }
}

/// A detection and the pose that it gives, not yet verified.
#[derive(Debug, Clone)]
pub(crate) struct PoseCandidate {
    /// The class's probability.
    pub(crate) class_probability: f64,
    /// The class's probability, reduced if the heads contradict each other, and changed by the comparison of the image
    /// with the demonstration.
    pub(crate) network_score: f64,
    pub(crate) bbox: BoundingBox,
    /// The keypoints, each with the network's score; empty for a model without keypoints.
    pub(crate) keypoints: Vec<(Point2<f64>, f64)>,
    pub(crate) grasp: PlanarGrasp,
    /// The demonstration to which the pose belongs.
    pub(crate) demonstration_idx: usize,
    /// The pose of the demonstration's cut-out in the image.
    pub(crate) image_from_cutout: PlanarSimilarity,
    pub(crate) turn_source: TurnSource,
}

impl PoseCandidate {
    /// The detection with the demonstration in this pose in a picture of this width and height, and the score of the
    /// pose.
    pub(super) fn in_pose(
        self,
        demonstration: &TaughtDemonstration,
        image_from_cutout: PlanarSimilarity,
        picture_size: [u32; 2],
        evidence: Option<ComparisonEvidence>,
    ) -> Self {
        let filled = consistency::filled(demonstration, &image_from_cutout, &self.bbox, picture_size);
        let network_score = consistency::score(self.class_probability, filled, evidence);
        let is_there = image_from_cutout == self.image_from_cutout;
        let placed = if is_there { self } else { self.moved_to(demonstration, image_from_cutout) };
        Self { network_score, ..placed }
    }

    /// The detection with another pose of the demonstration; the keypoints' scores are unchanged.
    fn moved_to(self, demonstration: &TaughtDemonstration, image_from_cutout: PlanarSimilarity) -> Self {
        let points = demonstration.keypoints().into_iter().map(|keypoint| image_from_cutout.apply(&keypoint.point()));
        let keypoints = points.zip(self.keypoints.iter().map(|(_, score)| *score)).collect();
        Self { keypoints, grasp: demonstration.grasp(&image_from_cutout), image_from_cutout, ..self }
    }
}
