//! The settings that determine the results of axes and of grasps under errors.

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
    /// The current version of pictures and scoring.
    pub const AXES: u32 = 1;
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
