//! Model C's own reading of what the network detected: keypoints to grasp, and the check by the demonstration.

use image::RgbImage;
use nalgebra::Point2;
use sdg_detection::Detections;
use sdg_geometry::{Angle, BoundingBox, Keypoint, PlanarGrasp, PlanarSimilarity};
use sdg_shape::{GradientField, SURFACE_SHARE};

use crate::model::pose_from_keypoints;
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
    pub(crate) keypoints: Vec<(Point2<f64>, f64)>,
    pub(crate) grasp: PlanarGrasp,
    /// The demonstration that it is compared with first.
    pub(crate) demonstration_idx: usize,
    /// Where that demonstration lies.
    pub(crate) image_from_cutout: PlanarSimilarity,
}

/// Reads the detections of one image, best first. Detections whose keypoints fall on one place are left out.
pub(crate) fn candidates(detections: &Detections, demonstrations: &[TaughtDemonstration]) -> Vec<Candidate> {
    (0..detections.scores.len())
        .filter(|&i| detections.scores[i] >= LEAST_NETWORK_SCORE)
        .take(MOST_CANDIDATES)
        .filter_map(|i| read(detections, i, demonstrations))
        .collect()
}

fn read(detections: &Detections, i: usize, demonstrations: &[TaughtDemonstration]) -> Option<Candidate> {
    let keypoints: Vec<(Point2<f64>, f64)> =
        detections.keypoints[i].iter().map(|k| (Point2::new(k.x, k.y), k.score)).collect();
    let bbox = detections.boxes[i];
    let line: Vec<Keypoint> = keypoints.iter().map(|(point, _)| Keypoint::visible(*point)).collect();
    let (demonstration_idx, image_from_cutout) = nearest_demonstration(demonstrations, &keypoints, &bbox)?;
    let width = demonstrations[demonstration_idx].marks.width_px * image_from_cutout.scale;
    Some(Candidate {
        network_score: detections.scores[i],
        bbox,
        grasp: PlanarGrasp::from_keypoints(&line, width)?,
        keypoints,
        demonstration_idx,
        image_from_cutout,
    })
}

/// The demonstration whose outline, laid over the keypoints, fills the detected box best.
fn nearest_demonstration(
    demonstrations: &[TaughtDemonstration],
    keypoints: &[(Point2<f64>, f64)],
    bbox: &BoundingBox,
) -> Option<(usize, PlanarSimilarity)> {
    demonstrations
        .iter()
        .enumerate()
        .filter_map(|(i, demonstration)| {
            let pose = pose_from_keypoints(demonstration, keypoints)?;
            Some((i, pose, demonstration.outline(&pose).bounds().iou(bbox)))
        })
        .max_by(|a, b| a.2.total_cmp(&b.2))
        .map(|(i, pose, _)| (i, pose))
}

/// Lays the demonstration over the image where the candidate is, both ways round, and returns the better pose with
/// its agreement.
///
/// The keypoints give place and turn well, but a short grasp line gives the scale badly, so the box decides that:
/// a second start takes the scale at which the outline is as large as the detected box.
pub(crate) fn verify(
    demonstration: &TaughtDemonstration,
    candidate: &Candidate,
    image: &RgbImage,
    field: &GradientField,
) -> (PlanarSimilarity, f64) {
    let pose = candidate.image_from_cutout;
    let outline = demonstration.outline(&pose).bounds();
    let box_over_outline = (candidate.bbox.area() / outline.area()).sqrt();
    let rescaled = about_grasp(demonstration, &pose, Angle::ZERO, box_over_outline.clamp(0.5, 2.0));
    let turned = about_grasp(demonstration, &rescaled, Angle::from_radians(std::f64::consts::PI), 1.0);
    let mut best = (pose, f64::NEG_INFINITY);
    for start in [rescaled, turned] {
        let refined = demonstration.refine(field, &start);
        let refined_pose = refined.image_from_demonstration;
        let surface = demonstration.surface_agreement(image, &refined_pose);
        let agreement = (1.0 - SURFACE_SHARE) * refined.agreement + SURFACE_SHARE * surface;
        if agreement > best.1 {
            best = (refined_pose, agreement);
        }
    }
    best
}

/// `pose` turned and scaled about the middle of the outline in the image.
fn about_grasp(
    demonstration: &TaughtDemonstration,
    pose: &PlanarSimilarity,
    turn: Angle,
    scale: f64,
) -> PlanarSimilarity {
    let pivot = demonstration.outline(pose).bounds().center();
    PlanarSimilarity::about(pivot, pivot, turn, scale).compose(pose)
}
