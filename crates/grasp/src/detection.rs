//! The result of a search in an image: a grasp with its score, and the pose of the demonstration.

use std::iter::repeat;

use nalgebra::Point2;
use sdg_geometry::{BoundingBox, PlanarGrasp, PlanarSimilarity, Polygon};
use sdg_shape::CloseLook;

use crate::check_config::ScoreConfig;
use crate::colors::Colors;
use crate::evidence_kind::{Advice, EvidenceKind};
use crate::facts::TurnSource;
use crate::region::SearchRegion;
use crate::sighting::Sighting;
use crate::verdict::Contributions;
use crate::verification::PlacedDemonstration;

/// One grasp found in an image; positions are in pixels of the given image.
#[derive(Debug, Clone, PartialEq)]
pub struct GraspDetection {
    /// Index of the demonstration that was found.
    pub demonstration_idx: usize,
    /// Calibrated, in `[0, 1]`: at least 0.5 is accepted.
    pub score: f64,
    /// The network's score, in `[0, 1]`; zero if no candidate of the network led to the detection (model S, and parts
    /// found by the search only).
    pub network_score: f64,
    /// Agreement of demonstration and image at the pose, in `[0, 1]`; `None` without verification.
    pub agreement: Option<f64>,
    /// The contributions to the score; `None` without verification.
    pub evidence: Option<Contributions>,
    /// The box around the part.
    pub bbox: BoundingBox,
    /// Keypoints along the grasp line, each with the network's score; empty for models without keypoints.
    pub keypoints: Vec<(Point2<f64>, f64)>,
    /// The demonstration's outline at its pose in the image; `None` without verification.
    pub outline: Option<Polygon>,
    /// Grasp point, direction and width, in pixels.
    pub grasp: PlanarGrasp,
    /// The source of the first estimate of the orientation.
    pub turn_source: TurnSource,
    /// Mean brightness at the detection divided by that of the demonstration; 1 without verification.
    pub light: f64,
}

impl GraspDetection {
    /// Whether the score accepts the detection as the part.
    pub fn is_accepted(&self) -> bool {
        self.score >= 0.5
    }

    /// Whether the part lies in a region of the picture: the region contains the grasp point and at least half of the
    /// outline's area (without verification, of the box's area).
    pub fn lies_in(&self, region: &SearchRegion) -> bool {
        let bounds = || Polygon::from_box(&self.bbox);
        region.has(&self.grasp.center(), &self.outline.clone().unwrap_or_else(bounds))
    }

    /// Whether the part lies in the searched region of a picture; without a region, whether the picture of this width
    /// and height contains the grasp point: an arm cannot grasp at a point that no camera shows.
    pub(crate) fn lies_within(&self, region: Option<&SearchRegion>, picture: [u32; 2]) -> bool {
        let [width, height] = picture.map(f64::from);
        let is_shown = || (0.0..width).contains(&self.grasp.x) && (0.0..height).contains(&self.grasp.y);
        region.map_or_else(is_shown, |region| self.lies_in(region))
    }

    /// The reason for a refusal, in words: the strongest objection. `None` for an accepted detection.
    pub fn refused(&self) -> Option<&'static str> {
        if self.is_accepted() {
            return None;
        }
        let Some(evidence) = &self.evidence else { return Some("the network is not sure") };
        Some(evidence.strongest_objection().map_or("all evidence together is too weak", EvidenceKind::objection))
    }

    /// The further demonstration, or the setting, that would help if a refused detection is the part after all;
    /// `config` is the one by which it was scored.
    pub fn advice(&self, config: &ScoreConfig) -> Option<Advice> {
        let evidence = self.evidence.as_ref().filter(|_| !self.is_accepted())?;
        evidence.advice(self.light, config)
    }
}

/// A detection and its placement.
pub(crate) struct Found {
    pub(crate) detection: GraspDetection,
    /// `None` without verification.
    pub(crate) placement: Option<Placement>,
}

/// The pose of a demonstration in an image, and the other data that a later image of the sequence needs.
#[derive(Debug, Clone)]
pub(crate) struct Placement {
    pub(crate) demonstration_idx: usize,
    pub(crate) image_from_cutout: PlanarSimilarity,
    pub(crate) image_from_marks: PlanarSimilarity,
    /// Whether the image has colours.
    pub(crate) colors: Colors,
    pub(crate) agreement: f64,
    pub(crate) close: Option<CloseLook>,
    pub(crate) network_score: f64,
    pub(crate) keypoint_scores: Vec<f64>,
    pub(crate) turn_source: TurnSource,
}

impl Placement {
    pub(crate) fn of(sighting: &Sighting<'_>) -> Self {
        let PlacedDemonstration {
            demonstration_idx,
            image_from_cutout,
            image_from_marks,
            colors,
            agreement,
            evidence,
            ..
        } = sighting.placed;
        Self {
            demonstration_idx,
            image_from_cutout,
            image_from_marks,
            colors,
            agreement,
            close: evidence.close,
            network_score: sighting.network_score,
            keypoint_scores: sighting.keypoint_scores.clone(),
            turn_source: sighting.turn_source,
        }
    }
}

impl Sighting<'_> {
    /// The detection at the pose of the demonstration.
    pub(crate) fn detection(self, score: f64, evidence: Contributions, num_keypoints: usize) -> GraspDetection {
        let PlacedDemonstration { demonstration, demonstration_idx, image_from_marks, agreement, .. } = self.placed;
        let outline = self.placed.outline();
        let marked = demonstration.keypoints().into_iter().map(|keypoint| image_from_marks.apply(&keypoint.point()));
        GraspDetection {
            demonstration_idx,
            score,
            network_score: self.network_score,
            agreement: Some(agreement),
            evidence: Some(evidence),
            bbox: outline.bounds(),
            keypoints: marked.zip(self.keypoint_scores.into_iter().chain(repeat(0.0))).take(num_keypoints).collect(),
            outline: Some(outline),
            grasp: demonstration.grasp(&image_from_marks),
            turn_source: self.turn_source,
            light: self.placed.light,
        }
    }
}
