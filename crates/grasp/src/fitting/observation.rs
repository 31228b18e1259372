//! The results of the search on a part's pictures: evidence of correct and of wrong poses, and the resemblance of other
//! objects.

use sdg_geometry::{Angle, PlanarGrasp};

use super::pictures::{FitInstance, FitPart, FitPicture};
use crate::check_config::CheckConfig;
use crate::error::Result;
use crate::taught::TaughtDemonstration;
use crate::teach::NUM_NEGATIVE_SCENES_WITHOUT_NETWORK;
use crate::teach::negatives::NegativeScenes;
use crate::teach::symmetry::HiddenTurns;
use crate::verdict::Clues;
use crate::verification::{PlacedDemonstration, SearchedImage, search};

/// Tolerance of a correct pose, as in `sdg evaluate --pictures`: distance between its grasp and the true one, as a
/// fraction of the diagonal of the demonstration's box, scaled to the picture.
const RIGHT_SHARE: f64 = 0.04;
/// Tolerance of a correct pose in angle, as in `sdg evaluate --pictures`.
const RIGHT_DEGREES: f64 = 10.0;

/// A pose that the search found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct PoseObservation {
    pub(super) clues: Clues,
    /// The instance of which this is a correct pose; `None` for a wrong pose.
    pub(super) instance_idx: Option<usize>,
}

#[derive(Debug, Clone, PartialEq)]
pub(super) struct PictureObservations {
    pub(super) num_instances: usize,
    /// The correct and the wrong poses, in arbitrary order.
    pub(super) poses: Vec<PoseObservation>,
}

impl PictureObservations {
    /// The evidence of the poses, as used for the decision about a picture.
    pub(super) fn clues(&self) -> Vec<Clues> {
        self.poses.iter().map(|pose| pose.clues).collect()
    }
}

#[derive(Debug, Clone, PartialEq)]
pub(super) struct PartObservations {
    pub(super) pictures: Vec<PictureObservations>,
}

impl PartObservations {
    /// The fraction of instances with a correct pose.
    pub(super) fn coverage(&self) -> f64 {
        let all: usize = self.pictures.iter().map(|picture| picture.num_instances).sum();
        let is_covered =
            |picture: &PictureObservations, idx| picture.poses.iter().any(|pose| pose.instance_idx == Some(idx));
        let covered: usize = self
            .pictures
            .iter()
            .map(|picture| (0..picture.num_instances).filter(|&idx| is_covered(picture, idx)).count())
            .sum();
        covered as f64 / (all as f64).max(1.0)
    }
}

/// A part with the data that do not depend on the configuration.
pub(super) struct PreparedPart<'a> {
    part: &'a FitPart,
    turns: HiddenTurns,
    negatives: NegativeScenes,
    taught: TaughtDemonstration,
}

impl<'a> PreparedPart<'a> {
    /// Prepares every part.
    ///
    /// # Errors
    /// A demonstration that cannot be taught.
    pub(super) fn prepare_all(parts: &'a [FitPart], seed: u64) -> Result<Vec<Self>> {
        parts
            .iter()
            .map(|part| {
                let demonstrations = std::slice::from_ref(&part.demonstration);
                Ok(Self {
                    part,
                    turns: HiddenTurns::new(demonstrations, part.symmetry),
                    negatives: NegativeScenes::new(demonstrations, seed, NUM_NEGATIVE_SCENES_WITHOUT_NETWORK)?,
                    taught: TaughtDemonstration::new(&part.demonstration)?,
                })
            })
            .collect()
    }

    /// Observes every part with a configuration.
    ///
    /// # Errors
    /// A configuration out of range.
    pub(super) fn observe_all(parts: &[Self], config: &CheckConfig) -> Result<Vec<PartObservations>> {
        parts.iter().map(|part| part.observe(config)).collect()
    }

    fn observe(&self, config: &CheckConfig) -> Result<PartObservations> {
        let taught = [self.taught.clone().with_check(config.clone())?];
        let resemblance = self.negatives.observe_as(config)?.resemblance();
        let observe = |picture| self.observe_picture(picture, &taught, resemblance);
        Ok(PartObservations { pictures: self.part.pictures.iter().map(observe).collect() })
    }

    fn observe_picture(
        &self,
        picture: &FitPicture,
        taught: &[TaughtDemonstration],
        resemblance: f64,
    ) -> PictureObservations {
        let mut poses = Vec::new();
        for placed in search(&SearchedImage::new(&picture.image, taught)) {
            let instance_idx =
                picture.instances.iter().position(|instance| is_right(&placed, instance, self.part, &self.turns));
            if instance_idx.is_none() && picture.is_undecided(&placed) {
                continue;
            }
            let PlacedDemonstration { evidence, image_from_cutout, .. } = placed;
            let log_size = image_from_cutout.scale.ln();
            poses.push(PoseObservation {
                clues: Clues { demonstration_idx: 0, evidence, log_size, network: None, resemblance },
                instance_idx,
            });
        }
        PictureObservations { num_instances: picture.instances.len(), poses }
    }
}

/// Whether a pose is that of an instance, up to symmetry.
pub(super) fn is_right(
    placed: &PlacedDemonstration<'_>,
    instance: &FitInstance,
    part: &FitPart,
    turns: &HiddenTurns,
) -> bool {
    let (share, turn) = error_of(placed, instance, part, turns);
    share <= RIGHT_SHARE && turn <= Angle::from_degrees(RIGHT_DEGREES).radians()
}

/// The distance of a pose's grasp from that of an instance: as a fraction of the instance's diagonal, and in radians,
/// up to symmetry.
pub(super) fn error_of(
    placed: &PlacedDemonstration<'_>,
    instance: &FitInstance,
    part: &FitPart,
    turns: &HiddenTurns,
) -> (f64, f64) {
    let truth = PlanarGrasp::from_line(&instance.grasp, 0.0);
    let found = placed.demonstration.grasp(&placed.image_from_marks);
    let found = turns.nearest(&found, truth.angle, 0, &instance.image_from_demonstration);
    let bbox = &part.demonstration.annotation.bbox;
    let diagonal = bbox.width().hypot(bbox.height()) * instance.image_from_demonstration.scale;
    ((found.center() - truth.center()).norm() / diagonal, found.angle.distance(truth.angle))
}

impl FitPicture {
    /// Whether a pose lies on a part that counts as neither correct nor wrong.
    pub(super) fn is_undecided(&self, placed: &PlacedDemonstration<'_>) -> bool {
        let middle = placed.outline().bounds().center();
        self.undecided.iter().any(|bbox| bbox.contains(&middle))
    }
}
