//! The check by the demonstration: laid over the image where a model proposes, refined and scored.

use image::RgbImage;
use sdg_geometry::{Angle, PlanarSimilarity};
use sdg_shape::{GradientField, SURFACE_SHARE};

use crate::models::Candidate;
use crate::taught::TaughtDemonstration;

/// An image with its gradients, which every overlay reads.
pub(crate) struct Scene<'a> {
    pub(crate) image: &'a RgbImage,
    pub(crate) field: GradientField,
}

impl<'a> Scene<'a> {
    pub(crate) fn new(image: &'a RgbImage) -> Self {
        Self { image, field: GradientField::new(image) }
    }
}

/// A demonstration laid over an image.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Overlay<'a> {
    pub(crate) demonstration: &'a TaughtDemonstration,
    pub(crate) image_from_cutout: PlanarSimilarity,
    /// How well it agrees with the image there, in `[0, 1]`.
    pub(crate) agreement: f64,
}

/// Lays the demonstration over the image where the candidate is, both ways round, and returns the better one.
///
/// Keypoints give place and turn well, but a short grasp line gives the scale badly, so the box decides that: the
/// start takes the scale at which the outline is as large as the detected box. A network that mistakes one end of a
/// part for the other is half a turn off; the demonstration sees which end it is.
pub(crate) fn verify<'a>(
    demonstration: &'a TaughtDemonstration,
    candidate: &Candidate,
    scene: &Scene<'_>,
) -> Overlay<'a> {
    let pose = candidate.image_from_cutout;
    let outline = demonstration.outline(&pose).bounds();
    let box_over_outline = (candidate.bbox.area() / outline.area()).sqrt();
    let rescaled = about_middle(demonstration, &pose, Angle::ZERO, box_over_outline.clamp(0.5, 2.0));
    let turned = about_middle(demonstration, &rescaled, Angle::from_radians(std::f64::consts::PI), 1.0);
    let [straight, turned] = [rescaled, turned].map(|start| refined(demonstration, &start, scene));
    if turned.agreement > straight.agreement { turned } else { straight }
}

/// The demonstration where it agrees best near `start`.
fn refined<'a>(demonstration: &'a TaughtDemonstration, start: &PlanarSimilarity, scene: &Scene<'_>) -> Overlay<'a> {
    let refined = demonstration.refine(&scene.field, start);
    let image_from_cutout = refined.image_from_demonstration;
    let surface = demonstration.surface_agreement(scene.image, &image_from_cutout);
    let agreement = (1.0 - SURFACE_SHARE) * refined.agreement + SURFACE_SHARE * surface;
    Overlay { demonstration, image_from_cutout, agreement }
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
