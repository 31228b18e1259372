//! Held-back samples: how good a network is, and where its scores are to be cut.

use sdg_demonstration::{Sample, SampleObject};
use sdg_geometry::{Keypoint, PlanarGrasp};
use sdg_training::{Outcome, median};

use super::symmetry::HiddenTurns;
use crate::calibration::Calibration;
use crate::error::Result;
use crate::model_file::Calibrations;
use crate::models::{Network, instant};
use crate::taught::TaughtDemonstration;
use crate::verification::{Overlay, Scene, verify};

/// Where the agreement's threshold may lie. Held-back samples know fewer look-alikes than a factory, and harder light
/// than most: on pictures of the simulator without the part, the demonstration looked for in the whole of each, the
/// highest agreements were 0.52 and 0.51 (92 pictures, pendulum; levers made to resemble it), 0.42 (fuel line, 20) and
/// 0.34 (rod end, 30); with the part, 0.65 and more (pendulum, 40), and 0.56 and more but for two of 40 (fuel line) and
/// two of 50 (rod end).
const AGREEMENT_THRESHOLDS: (f64, f64) = (0.545, 0.6);

/// What is left of the agreement's calibration without held-back samples, as in model S: the lowest threshold, and the
/// steepest slope, which takes 0.08 from it to a score of 0.88.
pub(super) const AGREEMENT_UNSEEN: Calibration = Calibration { threshold: AGREEMENT_THRESHOLDS.0, slope: 25.0 };

/// Samples that no network is trained on.
pub(super) struct HeldBack<'a> {
    pub(super) samples: &'a [Sample],
    pub(super) turns: &'a HiddenTurns,
}

/// Where both scores are cut, and the median errors after verification, in pixels of the demonstration and degrees:
/// infinite where nothing was found.
pub(super) struct Calibrated {
    pub(super) calibrations: Calibrations,
    pub(super) error_px: f64,
    pub(super) error_degrees: f64,
}

impl HeldBack<'_> {
    /// What the network alone says of held-back samples.
    ///
    /// # Errors
    /// An image that the network refuses.
    pub(super) fn examine(&self, network: &Network, demonstrations: &[TaughtDemonstration]) -> Result<Vec<Outcome>> {
        self.samples
            .iter()
            .map(|sample| {
                let best = network.candidates(&sample.image, demonstrations)?.into_iter().next();
                Ok(match (best, sample.objects.first()) {
                    (Some(candidate), Some(object)) => self.outcome(&candidate.grasp, object, candidate.network_score),
                    (None, Some(_)) => Outcome::Missed,
                    (candidate, None) => Outcome::Absent { score: candidate.map_or(0.0, |c| c.network_score) },
                })
            })
            .collect()
    }

    /// Tries network and search on held-back samples, laid over by the demonstration as in use.
    ///
    /// # Errors
    /// An image that the network refuses.
    pub(super) fn calibrate(&self, network: &Network, demonstrations: &[TaughtDemonstration]) -> Result<Calibrated> {
        let mut scores = Scores::default();
        let (mut errors_px, mut errors_degrees) = (Vec::new(), Vec::new());
        for sample in self.samples {
            let scene = Scene::new(&sample.image);
            // The highest score of a candidate that ended beside the part, and of one on it.
            let mut network_best = [0.0f64; 2];
            let mut judge = |overlay: &Overlay| {
                let grasp = overlay.demonstration.grasp(&overlay.image_from_cutout);
                let outcome = sample.objects.first().map(|object| self.outcome(&grasp, object, 1.0));
                let right = outcome.is_some_and(|outcome| outcome.is_hit());
                if let (true, Some(Outcome::Found { error_px, error_degrees, .. })) = (right, outcome) {
                    errors_px.push(error_px);
                    errors_degrees.push(error_degrees);
                }
                scores.agreement[usize::from(right)].push(overlay.agreement);
                right
            };
            for candidate in network.candidates(&sample.image, demonstrations)? {
                let right = judge(&verify(&demonstrations[candidate.demonstration_idx], &candidate, &scene));
                let best = &mut network_best[usize::from(right)];
                *best = best.max(candidate.network_score);
            }
            for overlay in instant::search(demonstrations, &scene) {
                judge(&overlay);
            }
            let [beside, on_part] = network_best;
            if on_part > 0.0 {
                scores.network[1].push(on_part);
            }
            if sample.objects.is_empty() {
                scores.network[0].push(beside);
            }
        }
        Ok(Calibrated {
            calibrations: scores.calibrations(),
            error_px: median(&mut errors_px).unwrap_or(f64::INFINITY),
            error_degrees: median(&mut errors_degrees).unwrap_or(f64::INFINITY),
        })
    }

    /// A grasp compared with the true one of an object in a sample.
    fn outcome(&self, grasp: &PlanarGrasp, object: &SampleObject, score: f64) -> Outcome {
        let (truth, pose) = (truth(object), &object.image_from_demonstration);
        let grasp = self.turns.nearest(grasp, truth.angle, object.demonstration_idx, pose);
        Outcome::found(&grasp, &truth, score, 1.0 / pose.scale)
    }
}

/// Raw scores of wrong and of right detections, in this order.
#[derive(Default)]
struct Scores {
    network: [Vec<f64>; 2],
    agreement: [Vec<f64>; 2],
}

impl Scores {
    fn calibrations(&self) -> Calibrations {
        /// Highest raw score of a wrong detection where the held-back samples gave none.
        const NO_WRONG: f64 = 0.1;
        let fit = |[wrong, right]: &[Vec<f64>; 2]| Calibration::fit(right, wrong, NO_WRONG);
        Calibrations {
            network: fit(&self.network).unwrap_or(Calibration::NEUTRAL),
            agreement: fit(&self.agreement).unwrap_or(Calibration::NEUTRAL).with_threshold_within(AGREEMENT_THRESHOLDS),
        }
    }
}

/// The true grasp of an object in a sample; its width plays no part.
fn truth(object: &SampleObject) -> PlanarGrasp {
    let on_line: Vec<Keypoint> = object.keypoints.iter().map(|k| Keypoint::visible(k.point())).collect();
    PlanarGrasp::from_keypoints(&on_line, 0.0).unwrap_or_else(|| panic!("a grasp line has a length"))
}
