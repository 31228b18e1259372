//! The grasp model: what was taught, and how it looks at an image.
//!
//! ```text
//! RgbImage ─ ImageTransform ─ GeneralizedRcnn ─ keypoints ─ pose of the demonstration ─ refined, scored by shape ─ PlanarGrasp
//! ```

use burn::tensor::Device;
use image::RgbImage;
use nalgebra::Point2;
use sdg_detection::{Detections, GeneralizedRcnn};
use sdg_geometry::{BoundingBox, PlanarGrasp, PlanarSimilarity, Polygon};
use sdg_shape::{GradientField, Match};

use crate::error::{GraspError, Result};
use crate::facts::{ModelKind, TeachingFacts};
use crate::model_file::Calibrations;
use crate::reading::{self, Candidate};
use crate::taught::TaughtDemonstration;
use crate::verification::verify;

/// No part can be told in an image with a shorter side.
const LEAST_SIDE_PX: u32 = 32;

/// A grasp model: taught from demonstrations, finds planar grasps.
#[derive(Debug, Clone)]
pub struct GraspModel {
    pub(crate) kind: ModelKind,
    pub(crate) preset: String,
    pub(crate) network: GeneralizedRcnn,
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
    /// The network alone decides and places.
    Off,
}

/// One grasp found in an image; places in pixels of the image as given.
#[derive(Debug, Clone, PartialEq)]
pub struct GraspDetection {
    /// Calibrated, in `[0, 1]`: 0.5 is the place to decide.
    pub score: f64,
    /// The network's own score, in `[0, 1]`.
    pub network_score: f64,
    /// How well the demonstration agrees with the image there, in `[0, 1]`; `None` without verification.
    pub agreement: Option<f64>,
    /// The box around the part.
    pub bbox: BoundingBox,
    /// Keypoints along the grasp line, each with the network's score.
    pub keypoints: Vec<(Point2<f64>, f64)>,
    /// The demonstration's outline as it lies in the image; `None` without verification.
    pub outline: Option<Polygon>,
    /// Where to grasp.
    pub grasp: PlanarGrasp,
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
        self.kind
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
        use burn::module::Module;
        self.network = self.network.to_device(device);
        self
    }

    /// Finds the part in an image, best score first. Detections below 0.5 are listed too, for whoever wants to see
    /// what was refused and why: [`GraspDetection::is_accepted`] tells.
    ///
    /// # Errors
    /// An image too small to show anything.
    pub fn detect(&self, image: &RgbImage, verification: Verification) -> Result<Vec<GraspDetection>> {
        let (width, height) = image.dimensions();
        if width.min(height) < LEAST_SIDE_PX {
            return Err(GraspError::ImageTooSmall { least: LEAST_SIDE_PX, width, height });
        }
        let detections = self.look(image)?;
        let candidates = reading::candidates(self.kind, &detections, &self.demonstrations);
        let mut found: Vec<GraspDetection> = match verification {
            Verification::Off => candidates.iter().map(|c| self.unverified(c)).collect(),
            Verification::ByShape => {
                let field = GradientField::new(image);
                let mut found: Vec<_> = candidates.iter().map(|c| self.verified(c, image, &field)).collect();
                if !found.iter().any(GraspDetection::is_accepted) {
                    found.extend(self.second_opinion(image, &field));
                }
                found
            }
        };
        found.sort_by(|a, b| b.score.total_cmp(&a.score));
        drop_repeated(&mut found);
        Ok(found)
    }

    /// The network's own detections.
    pub(crate) fn look(&self, image: &RgbImage) -> Result<Detections> {
        let transformed = self.network.image_transform().apply(image)?;
        Ok(self.network.detect(&[transformed]).pop().unwrap_or_default())
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
        }
    }

    /// Lays the demonstration over the image where the network proposes.
    fn verified(&self, candidate: &Candidate, image: &RgbImage, field: &GradientField) -> GraspDetection {
        let demonstration = &self.demonstrations[candidate.demonstration_idx];
        let (pose, agreement) = verify(demonstration, candidate, image, field);
        let scores = candidate.keypoints.iter().map(|(_, score)| *score).collect();
        self.laid_over(demonstration, &pose, agreement, candidate.network_score, scores, field)
    }

    /// Where the demonstration itself is found when the network finds nothing that it agrees with: looked for in the
    /// whole image. The network's score of such a detection is zero.
    fn second_opinion(&self, image: &RgbImage, field: &GradientField) -> Vec<GraspDetection> {
        let mut found = Vec::new();
        for demonstration in &self.demonstrations {
            for Match { image_from_demonstration: pose, agreement, .. } in demonstration.search(image, field) {
                let scores = match self.kind {
                    ModelKind::B | ModelKind::C => vec![0.0; crate::NUM_KEYPOINTS],
                };
                found.push(self.laid_over(demonstration, &pose, agreement, 0.0, scores, field));
            }
        }
        found
    }

    /// A detection as the demonstration says, where it lies; a keypoint for each score.
    fn laid_over(
        &self,
        demonstration: &TaughtDemonstration,
        pose: &PlanarSimilarity,
        agreement: f64,
        network_score: f64,
        keypoint_scores: Vec<f64>,
        field: &GradientField,
    ) -> GraspDetection {
        let outline = demonstration.outline(pose);
        let taught = demonstration.keypoints();
        GraspDetection {
            score: self.calibrations.agreement.apply(agreement),
            network_score,
            agreement: Some(agreement),
            bbox: outline.bounds().clip(field.width() as f64, field.height() as f64),
            keypoints: taught.iter().zip(keypoint_scores).map(|(k, score)| (pose.apply(&k.point()), score)).collect(),
            outline: Some(outline),
            grasp: demonstration.grasp(pose),
        }
    }
}

/// Detections that verification moved onto the same part, by the overlap of their boxes: the best one stays.
fn drop_repeated(found: &mut Vec<GraspDetection>) {
    const SAME_PART_IOU: f64 = 0.5;
    let mut kept: Vec<GraspDetection> = Vec::with_capacity(found.len());
    for detection in found.drain(..) {
        if kept.iter().all(|better| better.bbox.iou(&detection.bbox) < SAME_PART_IOU) {
            kept.push(detection);
        }
    }
    *found = kept;
}
