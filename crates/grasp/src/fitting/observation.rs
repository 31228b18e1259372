//! What the search sees of a part: agreements of right poses, of wrong ones, and of negatives.

use sdg_geometry::{Angle, PlanarGrasp};

use super::pictures::{FitInstance, FitPart, FitPicture};
use crate::check_config::CheckConfig;
use crate::error::Result;
use crate::models::instant;
use crate::taught::TaughtDemonstration;
use crate::teach::STRANGERS_INSTANT;
use crate::teach::strangers::Strangers;
use crate::teach::symmetry::HiddenTurns;
use crate::verification::{Overlay, Scene};

/// How far a right pose's grasp may lie from the true one, as a share of the diagonal of the demonstration's box, in the
/// picture's size; and how far it may be turned. The tolerances of `sdg evaluate --pictures`.
const RIGHT_SHARE: f64 = 0.04;
const RIGHT_DEGREES: f64 = 10.0;

/// A pose that the search found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct PoseObservation {
    /// Before anything is taken off for another size.
    pub(super) agreement_at_any_size: f64,
    /// Over the usual one.
    pub(super) scale: f64,
    /// The instance that it is a right pose of.
    pub(super) instance_idx: Option<usize>,
}

#[derive(Debug, Clone, PartialEq)]
pub(super) struct PictureObservations {
    pub(super) num_instances: usize,
    pub(super) poses: Vec<PoseObservation>,
}

#[derive(Debug, Clone, PartialEq)]
pub(super) struct PartObservations {
    /// The highest agreement in each composed picture without the part.
    pub(super) negatives: Vec<f64>,
    pub(super) pictures: Vec<PictureObservations>,
}

/// A part with what does not depend on the configuration.
pub(super) struct PreparedPart<'a> {
    part: &'a FitPart,
    turns: HiddenTurns,
    negatives: Strangers,
    taught: TaughtDemonstration,
}

impl<'a> PreparedPart<'a> {
    /// # Errors
    /// A demonstration that nothing can be taught from.
    pub(super) fn prepare_all(parts: &'a [FitPart], seed: u64) -> Result<Vec<Self>> {
        parts
            .iter()
            .map(|part| {
                let demonstrations = std::slice::from_ref(&part.demonstration);
                Ok(Self {
                    part,
                    turns: HiddenTurns::new(demonstrations, part.symmetry),
                    negatives: Strangers::new(demonstrations, seed, STRANGERS_INSTANT)?,
                    taught: TaughtDemonstration::new(&part.demonstration)?,
                })
            })
            .collect()
    }

    /// # Errors
    /// A configuration out of range.
    pub(super) fn observe_all(parts: &[Self], config: &CheckConfig) -> Result<Vec<PartObservations>> {
        parts.iter().map(|part| part.observe(config)).collect()
    }

    fn observe(&self, config: &CheckConfig) -> Result<PartObservations> {
        let taught = [self.taught.clone().with_check(config.clone())?];
        let negatives = self.negatives.agreements(None, &taught)?;
        let pictures = self.part.pictures.iter().map(|picture| self.observe_picture(picture, &taught)).collect();
        Ok(PartObservations { negatives, pictures })
    }

    fn observe_picture(&self, picture: &FitPicture, taught: &[TaughtDemonstration]) -> PictureObservations {
        let scene = Scene::new(&picture.image, taught);
        let (width, height) = picture.image.dimensions();
        let poses = instant::search(taught, &scene)
            .iter()
            .map(|overlay| PoseObservation {
                agreement_at_any_size: overlay.agreement_at_any_size,
                scale: overlay.image_from_cutout.scale / overlay.demonstration.usual_scale(width, height),
                instance_idx: picture.instances.iter().position(|instance| self.is_right(overlay, instance)),
            })
            .collect();
        PictureObservations { num_instances: picture.instances.len(), poses }
    }

    fn is_right(&self, overlay: &Overlay<'_>, instance: &FitInstance) -> bool {
        let truth = PlanarGrasp::from_line(&instance.grasp, 0.0);
        let found = overlay.demonstration.grasp(&overlay.image_from_cutout);
        let found = self.turns.nearest(&found, truth.angle, 0, &instance.image_from_demonstration);
        let bbox = &self.part.demonstration.annotation.bbox;
        let diagonal = bbox.width().hypot(bbox.height()) * instance.image_from_demonstration.scale;
        (found.center() - truth.center()).norm() <= RIGHT_SHARE * diagonal
            && found.angle.distance(truth.angle) <= Angle::from_degrees(RIGHT_DEGREES).radians()
    }
}
