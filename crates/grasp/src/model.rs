//! The grasp model: what was taught, and how it looks at an image.
//!
//! ```text
//! RgbImage ─ Network: detections, each read as a pose of the demonstration ─ laid over the image, refined, scored
//!     └───── no network, or nothing accepted: the demonstration looked for in the whole image ─────┘       │
//!                                                                                            PlanarGrasp ──┘
//! ```

use burn::tensor::{Device, read_sync};
use image::RgbImage;
use nalgebra::Point2;
use sdg_geometry::{BoundingBox, PlanarGrasp, Polygon};

use crate::error::{GraspError, Result};
use crate::facts::{ModelKind, TeachingFacts, TurnSource};
use crate::model_file::Calibrations;
use crate::models::{Candidate, Network, instant};
use crate::taught::TaughtDemonstration;
use crate::verification::{Overlay, Scene, verify};

/// No part can be told in an image with a shorter side. Chosen by hand, not measured: a level of the pyramid has 24 pixels.
const LEAST_SIDE_PX: u32 = 32;

/// A grasp model: taught from demonstrations, finds planar grasps.
#[derive(Debug, Clone)]
pub struct GraspModel {
    pub(crate) preset: String,
    /// `None` for model S.
    pub(crate) network: Option<Network>,
    pub(crate) demonstrations: Vec<TaughtDemonstration>,
    pub(crate) calibrations: Calibrations,
    pub(crate) facts: TeachingFacts,
}

/// Whether detections are laid over the demonstration.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Verification {
    /// Every detection is refined and scored by the demonstration.
    #[default]
    ByShape,
    /// The network alone decides and places. Model S has no network: it looks as ever.
    Off,
}

/// One grasp found in an image; places in pixels of the image as given.
#[derive(Debug, Clone, PartialEq)]
pub struct GraspDetection {
    /// Calibrated, in `[0, 1]`: 0.5 is the place to decide.
    pub score: f64,
    /// The network's own score, in `[0, 1]`; zero for what no network has seen (model S, second opinions).
    pub network_score: f64,
    /// How well the demonstration agrees with the image there, in `[0, 1]`; `None` without verification.
    pub agreement: Option<f64>,
    /// The box around the part.
    pub bbox: BoundingBox,
    /// Keypoints along the grasp line, each with the network's score; empty for models without.
    pub keypoints: Vec<(Point2<f64>, f64)>,
    /// The demonstration's outline as it lies in the image; `None` without verification.
    pub outline: Option<Polygon>,
    /// Where to grasp.
    pub grasp: PlanarGrasp,
    /// What the turn was first read from.
    pub turn_source: TurnSource,
}

impl GraspDetection {
    /// Whether the part is there.
    pub fn is_accepted(&self) -> bool {
        self.score >= 0.5
    }
}

impl GraspModel {
    /// The letter.
    pub fn kind(&self) -> ModelKind {
        self.network.as_ref().map_or(ModelKind::S, Network::kind)
    }

    /// The same network read as another model; `None` where the two are not taught alike (see [`ModelKind::taught_as`]).
    /// Its calibration stays, though the network's errors were judged by the first reading.
    pub fn read_as(self, kind: ModelKind) -> Option<Self> {
        if self.kind() == kind {
            return Some(self);
        }
        let network = self.network?.read_as(kind)?;
        Some(Self { network: Some(network), ..self })
    }

    /// The preset's name.
    pub fn preset(&self) -> &str {
        &self.preset
    }

    /// The object's name.
    pub fn object(&self) -> &str {
        &self.demonstrations[0].marks.label
    }

    /// How it was taught, and how good it was found to be.
    pub fn facts(&self) -> &TeachingFacts {
        &self.facts
    }

    /// The demonstrations, cut to the part.
    pub fn demonstrations(&self) -> &[TaughtDemonstration] {
        &self.demonstrations
    }

    /// Moves the network to another device.
    pub fn to_device(mut self, device: &Device) -> Self {
        self.network = self.network.map(|network| network.moved_to(device));
        self
    }

    /// The same model whose search of a whole image compares `num_points` edge points at each pose; taught models have 64.
    /// The calibration stays.
    ///
    /// # Errors
    /// A number of points outside 8 to 1024.
    pub fn with_search_points(self, num_points: usize) -> Result<Self> {
        let demonstrations = self.demonstrations.into_iter().map(|taught| taught.with_search_points(num_points));
        Ok(Self { demonstrations: demonstrations.collect::<Result<_>>()?, ..self })
    }

    /// Finds the part in an image, best score first. Detections below 0.5 are listed too, for whoever wants to see
    /// what was refused and why: [`GraspDetection::is_accepted`] tells.
    ///
    /// # Errors
    /// An image too small to show anything.
    pub fn detect(&self, image: &RgbImage, verification: Verification) -> Result<Vec<GraspDetection>> {
        read_sync(self.detect_async(image, verification))
    }

    /// [`Self::detect`], awaited; for browsers, which hand over what a graphics card computed in no other way.
    ///
    /// # Errors
    /// As there.
    pub async fn detect_async(&self, image: &RgbImage, verification: Verification) -> Result<Vec<GraspDetection>> {
        let (width, height) = image.dimensions();
        if width.min(height) < LEAST_SIDE_PX {
            return Err(GraspError::ImageTooSmall { least: LEAST_SIDE_PX, width, height });
        }
        let mut found: Vec<GraspDetection> = match (&self.network, verification) {
            (Some(network), Verification::Off) => network
                .candidates_async(image, &self.demonstrations)
                .await?
                .iter()
                .map(|c| self.unverified(c))
                .collect(),
            (Some(network), Verification::ByShape) => {
                let scene = Scene::new(image, &self.demonstrations);
                let candidates = network.candidates_async(image, &self.demonstrations).await?;
                let mut found: Vec<_> = candidates.iter().map(|c| self.verified(c, &scene)).collect();
                if !found.iter().any(GraspDetection::is_accepted) {
                    // A second opinion: the network finds nothing that the demonstration agrees with.
                    found.extend(self.searched(&scene));
                }
                found
            }
            (None, _) => self.searched(&Scene::new(image, &self.demonstrations)),
        };
        let (width, height) = (f64::from(width), f64::from(height));
        found.iter_mut().for_each(|detection| detection.bbox = detection.bbox.clip(width, height));
        found.sort_by(|a, b| b.score.total_cmp(&a.score));
        drop_repeated(&mut found);
        Ok(found)
    }

    fn unverified(&self, candidate: &Candidate) -> GraspDetection {
        GraspDetection {
            score: self.calibrations.network.apply(candidate.network_score),
            network_score: candidate.network_score,
            agreement: None,
            bbox: candidate.bbox,
            keypoints: candidate.keypoints.clone(),
            outline: None,
            grasp: candidate.grasp,
            turn_source: candidate.turn_source,
        }
    }

    /// Lays the demonstration over the image where the network proposes.
    fn verified(&self, candidate: &Candidate, scene: &Scene) -> GraspDetection {
        let overlay = verify(&self.demonstrations[candidate.demonstration_idx], candidate, scene);
        let keypoint_scores = candidate.keypoints.iter().map(|(_, score)| *score);
        self.laid_over(&overlay, candidate.network_score, keypoint_scores, candidate.turn_source)
    }

    /// Looks for the demonstrations in the whole image, with no network's help.
    fn searched(&self, scene: &Scene) -> Vec<GraspDetection> {
        let num_keypoints = if self.kind().has_keypoints() { crate::NUM_KEYPOINTS } else { 0 };
        let overlays = instant::search(&self.demonstrations, scene);
        let no_scores = || (0..num_keypoints).map(|_| 0.0);
        overlays.iter().map(|overlay| self.laid_over(overlay, 0.0, no_scores(), TurnSource::Search)).collect()
    }

    /// A detection as the demonstration says, where it lies; a keypoint for each score.
    fn laid_over(
        &self,
        overlay: &Overlay,
        network_score: f64,
        keypoint_scores: impl Iterator<Item = f64>,
        turn_source: TurnSource,
    ) -> GraspDetection {
        let &Overlay { demonstration, image_from_cutout: pose, agreement, .. } = overlay;
        let outline = demonstration.outline(&pose);
        let taught = demonstration.keypoints();
        GraspDetection {
            score: self.calibrations.agreement.apply(agreement),
            network_score,
            agreement: Some(agreement),
            bbox: outline.bounds(),
            keypoints: taught.iter().zip(keypoint_scores).map(|(k, score)| (pose.apply(&k.point()), score)).collect(),
            outline: Some(outline),
            grasp: demonstration.grasp(&pose),
            turn_source,
        }
    }
}

/// Detections that verification moved onto the same part, by the overlap of their boxes: the best one stays. Of those that
/// ended in the same pose it is the one that the network was surest of, and not a matter of the last bit.
fn drop_repeated(found: &mut Vec<GraspDetection>) {
    // Chosen by hand, not measured.
    const SAME_PART_IOU: f64 = 0.5;
    // Chosen by hand: above the rounding of single precision, below any difference that tells poses apart.
    const SAME_SCORE: f64 = 1e-4;
    let mut kept: Vec<GraspDetection> = Vec::with_capacity(found.len());
    for detection in found.drain(..) {
        match kept.iter_mut().find(|better| better.bbox.iou(&detection.bbox) >= SAME_PART_IOU) {
            None => kept.push(detection),
            Some(better) => {
                let as_good = better.score - detection.score < SAME_SCORE;
                if as_good && detection.network_score > better.network_score {
                    *better = detection;
                }
            }
        }
    }
    *found = kept;
}

#[cfg(test)]
mod tests {
    use super::*;
    use sdg_geometry::Angle;

    fn detection(x: f64, score: f64, network_score: f64) -> GraspDetection {
        GraspDetection {
            score,
            network_score,
            agreement: Some(score),
            bbox: BoundingBox { x1: x, y1: 0.0, x2: x + 20.0, y2: 10.0 },
            keypoints: Vec::new(),
            outline: None,
            grasp: PlanarGrasp { x: x + 10.0, y: 5.0, angle: Angle::from_degrees(0.0), width: 4.0 },
            turn_source: TurnSource::Keypoints,
        }
    }

    #[test]
    fn of_repeated_detections_the_best_stays_and_of_equals_the_surest() {
        let mut found = vec![
            detection(0.0, 0.900_000_1, 0.1),
            detection(0.0, 0.9, 0.7),
            detection(100.0, 0.8, 0.2),
            detection(1.0, 0.7, 0.99),
        ];
        drop_repeated(&mut found);
        let kept: Vec<_> = found.iter().map(|kept| (kept.bbox.x1, kept.network_score)).collect();
        assert_eq!(kept, [(0.0, 0.7), (100.0, 0.2)]);
    }
}
