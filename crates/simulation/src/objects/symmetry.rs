//! Which turns about the vertical cannot be told from none.

use std::f64::consts::TAU;

use sdg_geometry::Angle;
use serde::{Deserialize, Serialize};

/// Turns about the vertical that change neither how a part looks nor how it is held.
///
/// In `object.json`: `"none"`, `{"fold": 4}` or `"full"`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum RotationalSymmetry {
    /// Every direction looks different.
    None,
    /// So many equal turns make a whole one, two at least: a turn by any of them cannot be seen.
    Fold(u32),
    /// No turn can be seen.
    Full,
}

impl RotationalSymmetry {
    /// The shortest turn from one direction to the other or to any that looks like it, in radians, not negative.
    pub fn distance(self, one: Angle, other: Angle) -> f64 {
        match self {
            Self::None => one.distance(other),
            Self::Fold(count) => {
                let period = TAU / f64::from(count);
                let turn = (one - other).radians().rem_euclid(period);
                turn.min(period - turn)
            }
            Self::Full => 0.0,
        }
    }

    /// A fold of zero or one says nothing.
    pub(super) fn check(self) -> std::result::Result<(), String> {
        match self {
            Self::Fold(count @ 0..=1) => Err(format!("symmetry: expected fold 2 or more, found {count}")),
            _ => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

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
            assert_relative_eq!(degrees_apart(symmetry, one, other), expected, epsilon = 1e-9);
            assert_relative_eq!(degrees_apart(symmetry, other, one), expected, epsilon = 1e-9);
        }
    }

    #[test]
    fn it_is_written_as_a_word_or_a_number() {
        for (text, expected) in [
            ("\"none\"", RotationalSymmetry::None),
            ("{\"fold\": 3}", RotationalSymmetry::Fold(3)),
            ("\"full\"", RotationalSymmetry::Full),
        ] {
            assert_eq!(serde_json::from_str::<RotationalSymmetry>(text).unwrap(), expected);
        }
    }
}
