//! The facts about teaching in a model file.

pub use sdg_demonstration::ModelKind;
use sdg_geometry::RotationalSymmetry;
use serde::{Deserialize, Serialize};

use crate::lengths::Lengths;
use crate::region::SearchRegion;

/// The source of the first estimate of a part's orientation, before the demonstration is laid over the picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum TurnSource {
    /// Model A: the class of the box's crop.
    Crop,
    /// Models B and C: the line through the keypoints.
    Keypoints,
    /// Model D: SIFT keypoints of the part's texture.
    Texture,
    /// Model D with too little texture: the mask's outline, which may be wrong by 180°.
    Outline,
    /// Model S, and detections found by the search only: all orientations were tried.
    Search,
}

impl TurnSource {
    /// The name in files and in `--json`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Crop => "crop",
            Self::Keypoints => "keypoints",
            Self::Texture => "texture",
            Self::Outline => "outline",
            Self::Search => "search",
        }
    }
}

/// How a model was made and its measured quality.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TeachingFacts {
    /// The seed of every random choice.
    pub seed: u64,
    /// The part's symmetry, as given at teaching.
    #[serde(default, skip_serializing_if = "is_without_symmetry")]
    pub symmetry: RotationalSymmetry,
    /// Smallest and largest size, relative to the nominal one, at which the part is searched.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub size_tolerance: Option<[f64; 2]>,
    /// The lengths of a model for calibrated cameras; `None` for other models.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lengths: Option<Lengths>,
    /// The searched region of pictures; `None` for whole pictures. Teaching itself does not use it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub region: Option<SearchRegion>,
    /// Number of training samples.
    pub samples: usize,
    /// Optimiser steps.
    pub steps: usize,
    /// Wall-clock time from demonstration to model.
    pub seconds: f64,
    /// Measured quality; `None` for model S, which is taught without samples.
    #[serde(flatten)]
    pub validation: Option<ValidationFacts>,
    /// How the orientation CNN was made; `None` for models without one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub orientation: Option<OrientationFacts>,
    /// The result on pictures without the part; `None` if none were given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub negatives: Option<NegativeFacts>,
    /// SHA-256 of the initial weights; `None` for random values.
    pub base_weights_sha256: Option<String>,
}

fn is_without_symmetry(symmetry: &RotationalSymmetry) -> bool {
    *symmetry == RotationalSymmetry::None
}

/// The calibration of the score on the user's pictures without the part.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct NegativeFacts {
    /// Number of pictures.
    pub pictures: usize,
    /// Number of pictures in which the calibrated model accepts nothing.
    pub refused: usize,
    /// Log-odds that the calibration adds to every score; at most 0.
    pub log_odds: f64,
}

/// The quality of a model on held-out samples.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ValidationFacts {
    /// Fraction of the parts that the network alone finds within 9.2 demonstration pixels (`sdg_training::HIT_PX`) and
    /// 10°, in `[0, 1]`.
    #[serde(rename = "validation_hit_rate")]
    pub hit_rate: f64,
    /// Median error in pixels of the demonstration, after verification.
    #[serde(rename = "validation_error_px")]
    pub error_px: f64,
    /// Median error in degrees, after verification.
    #[serde(rename = "validation_error_degrees")]
    pub error_degrees: f64,
}

/// How model A's orientation CNN was made, and its measured quality.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct OrientationFacts {
    /// Number of crops used for training.
    pub crops: usize,
    /// Optimiser steps.
    pub steps: usize,
    /// Fraction of held-out crops with an angle error of at most 10°, in `[0, 1]`.
    pub hit_rate: f64,
    /// Median angle error on the held-out crops, in degrees.
    pub error_degrees: f64,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn facts_keep_the_names_that_files_have() {
        let file = r#"{"seed": 1, "samples": 2, "steps": 3, "seconds": 4.0, "validation_hit_rate": 0.9,
            "validation_error_px": 0.8, "validation_error_degrees": 0.7, "base_weights_sha256": null}"#;
        let facts: TeachingFacts = serde_json::from_str(file).unwrap();
        assert_eq!(facts.validation, Some(ValidationFacts { hit_rate: 0.9, error_px: 0.8, error_degrees: 0.7 }));
        let written = serde_json::to_value(&facts).unwrap();
        assert_eq!(written, serde_json::from_str::<serde_json::Value>(file).unwrap());
        assert_eq!((facts.symmetry, facts.region), (RotationalSymmetry::None, None));
        let region = Some(SearchRegion::new([10, 20, 200, 100]).of_picture([640, 480]));
        let without_network =
            TeachingFacts { validation: None, symmetry: RotationalSymmetry::Fold(2), region, ..facts };
        let written = serde_json::to_string(&without_network).unwrap();
        assert_eq!(serde_json::from_str::<TeachingFacts>(&written).unwrap(), without_network);
    }
}
