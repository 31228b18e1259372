//! What a model file tells about itself.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use crate::GraspError;

/// The grasp models of the paper, by their letters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum ModelKind {
    /// Keypoint R-CNN; position from the box, angle from the keypoints (paper, section IV-B).
    B,
    /// Keypoint R-CNN; position and angle from the keypoints (paper, section IV-C).
    C,
}

impl ModelKind {
    /// Every model that this version teaches.
    pub const ALL: [Self; 2] = [Self::B, Self::C];

    /// The letter, as on the command line and in the file.
    pub fn letter(self) -> &'static str {
        match self {
            Self::B => "B",
            Self::C => "C",
        }
    }
}

impl fmt::Display for ModelKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.letter())
    }
}

impl FromStr for ModelKind {
    type Err = GraspError;

    fn from_str(text: &str) -> Result<Self, GraspError> {
        Self::ALL.into_iter().find(|kind| kind.letter().eq_ignore_ascii_case(text)).ok_or_else(|| {
            GraspError::UnknownModel { known: Self::ALL.map(Self::letter).to_vec(), found: text.to_owned() }
        })
    }
}

/// How a model came to be and how good it was found to be.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TeachingFacts {
    /// Decides every random choice.
    pub seed: u64,
    /// Samples that the network saw.
    pub samples: usize,
    /// Optimiser steps.
    pub steps: usize,
    /// Wall-clock time from demonstration to model.
    pub seconds: f64,
    /// Held-back samples with the part found within 10 mm and 10°, in `[0, 1]`, network alone.
    pub validation_hit_rate: f64,
    /// Median error on them in pixels of the demonstration, after verification.
    pub validation_error_px: f64,
    /// Median error on them in degrees, after verification.
    pub validation_error_degrees: f64,
    /// SHA-256 of the weights that teaching started from; `None` when it started from nothing.
    pub base_weights_sha256: Option<String>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn letters_round_trip_and_others_are_refused() {
        assert_eq!("c".parse::<ModelKind>().unwrap(), ModelKind::C);
        let refused = "Z".parse::<ModelKind>().unwrap_err().to_string();
        assert_eq!(refused, "expected a grasp model out of B, C, found \"Z\"");
    }
}
