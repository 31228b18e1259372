//! The rotations of a part that change neither its appearance nor its grasp.

use std::f64::consts::TAU;

use serde::{Deserialize, Serialize};

use crate::Angle;

/// The rotations about the vertical that change neither the appearance of a part nor its grasp.
///
/// In JSON: `"none"`, `{"fold": 4}` or `"full"`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum RotationalSymmetry {
    /// No rotation except the identity.
    #[default]
    None,
    /// The multiples of 2π / n, where n is this number, at least two.
    Fold(u32),
    /// All rotations.
    Full,
}

impl RotationalSymmetry {
    /// The smallest of the rotations equivalent to `turn`.
    pub fn visible(self, turn: Angle) -> Angle {
        match self {
            Self::None => turn,
            Self::Fold(count) => {
                let period = TAU / f64::from(count);
                Angle::from_radians(turn.radians() - period * (turn.radians() / period).round())
            }
            Self::Full => Angle::ZERO,
        }
    }

    /// The smallest rotation from one direction to the other or to an equivalent one, in radians, not negative.
    pub fn distance(self, one: Angle, other: Angle) -> f64 {
        self.visible(one - other).radians().abs()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn degrees_apart(symmetry: RotationalSymmetry, one: f64, other: f64) -> f64 {
        symmetry.distance(Angle::from_degrees(one), Angle::from_degrees(other)).to_degrees()
    }

    #[test]
    fn only_turns_that_can_be_seen_count() {
        for (symmetry, one, other, expected) in [
            (RotationalSymmetry::None, 170.0, -10.0, 180.0),
            (RotationalSymmetry::Fold(2), 170.0, -10.0, 0.0),
            (RotationalSymmetry::Fold(2), 10.0, -40.0, 50.0),
            (RotationalSymmetry::Fold(2), -100.0, 75.0, 5.0),
            (RotationalSymmetry::Fold(9), 1.0, 40.0, 1.0),
            (RotationalSymmetry::Fold(9), -179.0, 179.0, 2.0),
            (RotationalSymmetry::Full, 10.0, -140.0, 0.0),
        ] {
            assert!((degrees_apart(symmetry, one, other) - expected).abs() < 1e-9, "{symmetry:?} {one} {other}");
            assert!((degrees_apart(symmetry, other, one) - expected).abs() < 1e-9, "{symmetry:?} {other} {one}");
        }
    }
}
