//! A network's hit rate, errors and score threshold on held-out samples.

use sdg_demonstration::{Sample, SampleObject};
use sdg_geometry::{Keypoint, PlanarGrasp, median};
use sdg_training::Outcome;

use super::side_by_side::side_by_side;
use super::symmetry::HiddenTurns;
use crate::error::Result;
use crate::facts::TurnSource;
use crate::models::{Network, Proposals};
use crate::network_calibration::NetworkCalibration;
use crate::sighting::{Sighting, best_agreement, sightings, sightings_to_first};
use crate::taught::TaughtDemonstration;
use crate::verification::{SearchedImage, search};

/// The samples on which no network is trained.
pub(super) struct HeldBack<'a> {
    pub(super) samples: &'a [Sample],
    pub(super) turns: &'a HiddenTurns,
}

/// The calibration of a network on held-out samples.
pub(super) struct Calibrated {
    pub(super) network: NetworkCalibration,
    /// Number of samples with the part.
    pub(super) positives: usize,
    /// Number of samples in which a candidate of the network led to a correct pose of the demonstration.
    pub(super) hits: usize,
    /// The network's scores where network or search found the part; 0 without a box.
    pub(super) on_part: Vec<f64>,
    /// The network's scores on the place most similar to the part in samples without it; 0 without a box.
    pub(super) elsewhere: Vec<f64>,
    /// Median error after verification, in pixels of the demonstration; infinite if nothing was found.
    pub(super) error_px: f64,
    /// Median error after verification, in degrees; infinite if nothing was found.
    pub(super) error_degrees: f64,
}

/// The observations in one sample.
struct Seen {
    /// The network's highest score on the part where a candidate of the network found it.
    proposed_on_part: Option<f64>,
    /// The network's highest score on the part where network or search found it.
    on_part: Option<f64>,
    /// The network's highest score in a sample without the part.
    without_part: Option<f64>,
    /// The network's score on the place most similar to the part, in a sample without it.
    elsewhere: Option<f64>,
    /// Errors of the detections on the part, in pixels of the demonstration and degrees.
    errors: Vec<[f64; 2]>,
}

impl HeldBack<'_> {
    /// A network's boxes and candidates in each sample.
    ///
    /// # Errors
    /// An image that is invalid for the network.
    pub(super) fn propose(&self, network: &Network, demonstrations: &[TaughtDemonstration]) -> Result<Vec<Proposals>> {
        side_by_side(self.samples, |sample| network.proposals(&sample.image, demonstrations))
    }

    /// The result of the network alone in each sample: its best candidate, compared with the truth.
    pub(super) fn outcomes(&self, proposals: &[Proposals]) -> Vec<Outcome> {
        let outcome =
            |(sample, proposals): (&Sample, &Proposals)| match (proposals.candidates.first(), sample.objects.first()) {
                (Some(candidate), Some(object)) => self.outcome(&candidate.grasp, object, candidate.network_score),
                (None, Some(_)) => Outcome::Missed,
                (candidate, None) => Outcome::Absent { score: candidate.map_or(0.0, |c| c.network_score) },
            };
        self.samples.iter().zip(proposals).map(outcome).collect()
    }

    /// Calibrates a network by its candidates in each sample, verified by the demonstration as in detection.
    /// `other_parts` are the network's highest scores in pictures of other parts only, `usual_threshold` is
    /// [`Network::usual_threshold`].
    ///
    /// # Errors
    /// An image that cannot be searched.
    pub(super) fn calibrate(
        &self,
        usual_threshold: Option<f64>,
        proposals: &[Proposals],
        demonstrations: &[TaughtDemonstration],
        other_parts: &[f64],
    ) -> Result<Calibrated> {
        /// Assumed highest raw score of a wrong detection if the held-out samples gave none. Chosen by hand, not
        /// measured.
        const RAW_SCORE_WITHOUT_WRONG: f64 = 0.1;
        let samples: Vec<(&Sample, &Proposals)> = self.samples.iter().zip(proposals).collect();
        let seen = side_by_side(&samples, |(sample, proposals)| Ok(self.measure(sample, proposals, demonstrations)))?;
        let scores = |score: fn(&Seen) -> Option<f64>| seen.iter().filter_map(score).collect::<Vec<_>>();
        let right_scores = scores(|seen| seen.proposed_on_part);
        let on_part = scores(|seen| seen.on_part);
        let elsewhere = scores(|seen| seen.elsewhere);
        let wrong_scores = [other_parts, &scores(|seen| seen.without_part)].concat();
        let errors = || seen.iter().flat_map(|seen| &seen.errors);
        Ok(Calibrated {
            positives: self.samples.iter().filter(|sample| !sample.objects.is_empty()).count(),
            hits: right_scores.len(),
            network: NetworkCalibration::fit(&right_scores, &wrong_scores, RAW_SCORE_WITHOUT_WRONG, usual_threshold)
                .unwrap_or(NetworkCalibration::NEUTRAL),
            on_part,
            elsewhere,
            error_px: median(errors().map(|[px, _]| *px)).unwrap_or(f64::INFINITY),
            error_degrees: median(errors().map(|[_, degrees]| *degrees)).unwrap_or(f64::INFINITY),
        })
    }

    fn measure(&self, sample: &Sample, proposals: &Proposals, demonstrations: &[TaughtDemonstration]) -> Seen {
        let searched = SearchedImage::new(&sample.image, demonstrations);
        let hit = |sighting: &Sighting| {
            let grasp = sighting.placed.demonstration.grasp(&sighting.placed.image_from_marks);
            sample.objects.first().map(|object| self.outcome(&grasp, object, 1.0)).filter(Outcome::is_hit)
        };
        let has_part = !sample.objects.is_empty();
        let sightings = match has_part {
            true => sightings_to_first(proposals, &searched, |sighting| hit(sighting).is_some()),
            false => sightings(proposals, &search(&searched), &searched),
        };
        let highest = |right: bool, proposed: bool| {
            let of_kind = sightings
                .iter()
                .filter(|s| hit(s).is_some() == right && (!proposed || s.turn_source != TurnSource::Search));
            of_kind.map(|sighting| sighting.network_score).reduce(f64::max)
        };
        // Detections by the search do not count for the network, but their errors count for the model.
        let errors = sightings.iter().filter_map(hit).filter_map(|outcome| match outcome {
            Outcome::Found { error_px, error_degrees, .. } => Some([error_px, error_degrees]),
            _ => None,
        });
        Seen {
            proposed_on_part: highest(true, true),
            on_part: highest(true, false),
            without_part: (!has_part).then(|| highest(false, true).unwrap_or(0.0)),
            elsewhere: best_agreement(&sightings).filter(|_| !has_part).map(|sighting| sighting.network_score),
            errors: errors.collect(),
        }
    }

    /// A grasp compared with the true one of an object in a sample.
    fn outcome(&self, grasp: &PlanarGrasp, object: &SampleObject, score: f64) -> Outcome {
        let (truth, pose) = (truth(object), &object.image_from_demonstration);
        let grasp = self.turns.nearest(grasp, truth.angle, object.demonstration_idx, pose);
        Outcome::found(&grasp, &truth, score, 1.0 / pose.scale)
    }
}

/// The true grasp of an object in a sample; its width is not used.
fn truth(object: &SampleObject) -> PlanarGrasp {
    let on_line: Vec<Keypoint> = object.keypoints.iter().map(|k| Keypoint::visible(k.point())).collect();
    PlanarGrasp::from_keypoints(&on_line, 0.0).unwrap_or_else(|| panic!("expected a grasp line of non-zero length"))
}
