//! The grasp models that a demonstration can be taught to: their names and the marks that each needs. Their methods are
//! in `sdg-grasp`.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

/// The grasp models, by their letters: four of the paper, and one without a network. A model is chosen by letter or
/// name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum ModelKind {
    /// Faster R-CNN; position from the box, angle from a CNN on the box's crop (paper, section IV-A).
    A,
    /// Keypoint R-CNN; position from the box, angle from the keypoints (paper, section IV-B).
    B,
    /// Keypoint R-CNN; position and angle from the keypoints (paper, section IV-C).
    C,
    /// Mask R-CNN; position and angle from the mask's texture or outline (paper, section IV-D).
    D,
    /// No network; the whole image is searched for the demonstration itself.
    S,
}

impl ModelKind {
    /// Every model.
    pub const ALL: [Self; 5] = [Self::A, Self::B, Self::C, Self::D, Self::S];

    /// The name, as on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::A => "crop",
            Self::B => "box",
            Self::C => "keypoints",
            Self::D => "mask",
            Self::S => "shape",
        }
    }

    /// Whether its demonstrations must have an outline.
    pub fn needs_outline(self) -> bool {
        self == Self::D
    }

    /// The letter, as on the command line and in the file.
    pub fn letter(self) -> &'static str {
        match self {
            Self::A => "A",
            Self::B => "B",
            Self::C => "C",
            Self::D => "D",
            Self::S => "S",
        }
    }

    /// Whether its detections have keypoints.
    pub fn has_keypoints(self) -> bool {
        matches!(self, Self::B | Self::C)
    }

    /// Whether it uses a network; model S consists of the demonstration only.
    pub fn has_network(self) -> bool {
        self != Self::S
    }

    /// The model whose network this one uses: B and C are taught alike and read differently, so C's file serves
    /// both.
    pub fn taught_as(self) -> Self {
        match self {
            Self::B => Self::C,
            other => other,
        }
    }
}

impl fmt::Display for ModelKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.letter())
    }
}

impl FromStr for ModelKind {
    type Err = UnknownModel;

    /// Reads a letter or a name, in upper or lower case.
    fn from_str(text: &str) -> Result<Self, UnknownModel> {
        let is_named = |kind: &Self| [kind.letter(), kind.name()].iter().any(|name| name.eq_ignore_ascii_case(text));
        Self::ALL.into_iter().find(is_named).ok_or_else(|| UnknownModel { found: text.to_owned() })
    }
}

/// A text that is neither a letter nor a name of a grasp model.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("expected a grasp model out of {}, found \"{found}\"", ModelKind::ALL.map(ModelKind::letter).join(", "))]
pub struct UnknownModel {
    /// The requested model.
    pub found: String,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn letters_round_trip_and_others_are_refused() {
        assert_eq!("c".parse::<ModelKind>().unwrap(), ModelKind::C);
        for kind in ModelKind::ALL {
            assert_eq!(kind.name().parse(), Ok(kind));
        }
        let refused = "Z".parse::<ModelKind>().unwrap_err().to_string();
        assert_eq!(refused, "expected a grasp model out of A, B, C, D, S, found \"Z\"");
    }
}
