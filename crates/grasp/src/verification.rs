//! The check by the demonstration: laid over the image where a model proposes, refined and scored.

use image::RgbImage;
use sdg_geometry::{Angle, PlanarSimilarity};
use sdg_shape::{GradientField, SURFACE_SHARE};

use crate::reading::Candidate;
use crate::taught::TaughtDemonstration;

/// Lays the demonstration over the image where the candidate is, both ways round, and returns the better pose with
/// its agreement.
///
/// Keypoints give place and turn well, but a short grasp line gives the scale badly, so the box decides that: the
/// start takes the scale at which the outline is as large as the detected box. A network that mistakes one end of a
/// part for the other is half a turn off; the demonstration sees which end it is.
pub(crate) fn verify(
    demonstration: &TaughtDemonstration,
    candidate: &Candidate,
    image: &RgbImage,
    field: &GradientField,
) -> (PlanarSimilarity, f64) {
    let pose = candidate.image_from_cutout;
    let outline = demonstration.outline(&pose).bounds();
    let box_over_outline = (candidate.bbox.area() / outline.area()).sqrt();
    let rescaled = about_middle(demonstration, &pose, Angle::ZERO, box_over_outline.clamp(0.5, 2.0));
    let turned = about_middle(demonstration, &rescaled, Angle::from_radians(std::f64::consts::PI), 1.0);
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
fn about_middle(
    demonstration: &TaughtDemonstration,
    pose: &PlanarSimilarity,
    turn: Angle,
    scale: f64,
) -> PlanarSimilarity {
    let pivot = demonstration.outline(pose).bounds().center();
    PlanarSimilarity::about(pivot, pivot, turn, scale).compose(pose)
}
