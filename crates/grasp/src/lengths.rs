//! A model's lengths: part of its file.

use serde::{Deserialize, Serialize};

use crate::error::{GraspError, Result};

/// Maximum resolution: a micrometre per pixel. Chosen by hand.
const MAX_PIXELS_PER_M: f64 = 1e6;
/// Maximum height: a part as high as a person. Chosen by hand.
const MAX_HEIGHT_M: f64 = 2.0;

/// The lengths of a model for calibrated cameras.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
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
}

impl Lengths {
    /// Checks that the values are possible.
    ///
    /// # Errors
    /// [`GraspError::Damaged`] for impossible values.
    pub(crate) fn check(&self) -> Result<()> {
        let Self { pixels_per_m, mark_height_m, grasp_height_m, slant } = *self;
        let is_height = |height: f64| (0.0..MAX_HEIGHT_M).contains(&height);
        if (1.0..MAX_PIXELS_PER_M).contains(&pixels_per_m)
            && is_height(mark_height_m)
            && is_height(grasp_height_m)
            && slant.iter().all(|share| share.is_finite())
        {
            return Ok(());
        }
        Err(GraspError::Damaged {
            expected: format!("1 to {MAX_PIXELS_PER_M} pixels per metre and heights of 0 to {MAX_HEIGHT_M} m"),
            found: format!("{self:?}"),
        })
    }
}
