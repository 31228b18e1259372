//! The settings that determine the results of axes and of grasps under errors.

use sdg_simulation::views::PICTURES_PER_AXIS;
use serde::{Deserialize, Serialize};

use crate::simulated::settings::TeachingSettings;

/// The settings that determine the detections in the pictures of an axis, besides axis, model and part.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct AxisSettings {
    /// Version of rendering and scoring; raised when either changes.
    pub axes: u32,
    /// How the models were taught.
    #[serde(flatten)]
    pub teaching: TeachingSettings,
    /// Number of pictures of each part and axis.
    pub axis_views: u32,
    /// Number of edge points that model S compares at each pose of its search; `None` for the taught number.
    pub search_points: Option<u32>,
}

impl AxisSettings {
    /// The current version of pictures and scoring, for complete rounds of pictures.
    const AXES: u32 = 1;
    /// The current version if the last round is incomplete: its pictures depend on the number of pictures.
    const INCOMPLETE_ROUND: u32 = 2;

    /// The current version of pictures and scoring.
    pub fn version(axis_views: u32) -> u32 {
        if has_complete_rounds(axis_views) { Self::AXES } else { Self::INCOMPLETE_ROUND }
    }
}

/// Whether this number of pictures has the same number in each stratum of an axis.
pub(in crate::simulated) fn has_complete_rounds(axis_views: u32) -> bool {
    u64::from(axis_views).is_multiple_of(PICTURES_PER_AXIS)
}

/// The settings that determine attempts under errors, besides the error, model and part.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct AttemptSettings {
    /// Version of the errors and their sizes; raised when they change.
    pub errors: u32,
    /// How the models were taught.
    #[serde(flatten)]
    pub teaching: TeachingSettings,
    /// Number of attempts of each model on each part under each error.
    pub attempts: u32,
    /// Number of edge points that model S compares at each pose of its search; `None` for the taught number.
    pub search_points: Option<u32>,
}

impl AttemptSettings {
    /// The current version of the errors.
    pub const ERRORS: u32 = 1;
}
