//! A model's lengths: part of its file.

use nalgebra::{Rotation2, Vector2};
use sdg_geometry::Angle;
use serde::{Deserialize, Serialize};

use crate::error::{GraspError, Result};

/// Maximum resolution: a micrometre per pixel. Chosen by hand.
const MAX_PIXELS_PER_M: f64 = 1e6;
/// Maximum height: a part as high as a person. Chosen by hand.
const MAX_HEIGHT_M: f64 = 2.0;

/// The lengths of a model for calibrated cameras.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Lengths {
    /// Pixels of the demonstrations per metre.
    pub pixels_per_m: f64,
    /// Height of the marks' plane above the table, in metres.
    pub mark_height_m: f64,
    /// Height above the table at which the gripper closes, in metres.
    pub grasp_height_m: f64,
    /// The direction from which the first photo shows the part; see `slant` in plan_view/mod.rs. 0 in models of earlier
    /// versions.
    #[serde(default)]
    pub slant: [f64; 2],
    /// The same for the further photos, in their order.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub further_slants: Vec<[f64; 2]>,
    /// The height of the compared edges; `None` if it was not measured, as with one photo.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub edges: Option<EdgeHeight>,
}

/// The mean height of the compared edges above the plane of the marks.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct EdgeHeight {
    /// Height, in metres.
    pub height_m: f64,
    /// Standard deviation, in metres.
    pub sigma_m: f64,
}

impl Lengths {
    /// The lengths of photos that were taken vertically from above.
    pub fn of_level_photos(pixels_per_m: f64, mark_height_m: f64, grasp_height_m: f64) -> Self {
        let slant = [0.0; 2];
        Self { pixels_per_m, mark_height_m, grasp_height_m, slant, further_slants: Vec::new(), edges: None }
    }

    /// The direction from which a demonstration's photo shows the part.
    pub(crate) fn slant_of(&self, demonstration_idx: usize) -> [f64; 2] {
        let further = demonstration_idx.checked_sub(1).and_then(|idx| self.further_slants.get(idx));
        *further.unwrap_or(&self.slant)
    }

    /// The slant of a picture minus that of a demonstration's photo, which is rotated with the part by `turn` from the
    /// photo to the picture.
    pub(crate) fn changed_slant(&self, slant: [f64; 2], demonstration_idx: usize, turn: Angle) -> Vector2<f64> {
        let taught = Vector2::from(self.slant_of(demonstration_idx));
        Vector2::from(slant) - Rotation2::new(turn.radians()) * taught
    }

    /// Checks that the values are possible.
    ///
    /// # Errors
    /// [`GraspError::Damaged`] for impossible values.
    pub(crate) fn check(&self) -> Result<()> {
        let Self { pixels_per_m, mark_height_m, grasp_height_m, edges, .. } = *self;
        let is_height = |height: f64| (0.0..MAX_HEIGHT_M).contains(&height);
        if (1.0..MAX_PIXELS_PER_M).contains(&pixels_per_m)
            && is_height(mark_height_m)
            && is_height(grasp_height_m)
            && edges.is_none_or(|edges| edges.height_m.abs() < MAX_HEIGHT_M && is_height(edges.sigma_m))
            && self.further_slants.iter().chain([&self.slant]).flatten().all(|share| share.is_finite())
        {
            return Ok(());
        }
        Err(GraspError::Damaged {
            expected: format!("1 to {MAX_PIXELS_PER_M} pixels per metre and heights of 0 to {MAX_HEIGHT_M} m"),
            found: format!("{self:?}"),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slants_and_edge_heights_must_be_possible() {
        let lengths = Lengths::of_level_photos(1000.0, 0.02, 0.01);
        let edges = Some(EdgeHeight { height_m: -0.003, sigma_m: 0.002 });
        let measured = Lengths { slant: [0.1, 0.2], further_slants: vec![[0.3, 0.4]], edges, ..lengths };
        assert!(measured.check().is_ok());
        assert_eq!([0, 1].map(|idx| measured.slant_of(idx)), [[0.1, 0.2], [0.3, 0.4]]);
        // A file of an earlier version has only the first photo's slant.
        assert_eq!(measured.slant_of(2), [0.1, 0.2]);
        let turned = measured.changed_slant([1.0, 1.0], 1, Angle::from_degrees(90.0));
        assert!((turned - Vector2::new(1.4, 0.7)).norm() < 1e-12, "{turned}");
        for (height_m, sigma_m) in [(2.5, 0.001), (f64::NAN, 0.001), (0.001, -0.001), (0.001, f64::INFINITY)] {
            let edges = Some(EdgeHeight { height_m, sigma_m });
            assert!(Lengths { edges, ..measured.clone() }.check().is_err(), "{height_m}, {sigma_m}");
        }
        assert!(Lengths { further_slants: vec![[f64::NAN, 0.0]], ..measured }.check().is_err());
    }

    #[test]
    fn lengths_of_earlier_versions_are_read() {
        let earlier = r#"{"pixels_per_m":1000.0,"mark_height_m":0.02,"grasp_height_m":0.01}"#;
        assert_eq!(serde_json::from_str::<Lengths>(earlier).unwrap(), Lengths::of_level_photos(1000.0, 0.02, 0.01));
    }
}
