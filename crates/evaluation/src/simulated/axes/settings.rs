//! The settings on which the results of axes and of grasps under errors depend.

use serde::{Deserialize, Serialize};

use crate::simulated::settings::TeachingSettings;

/// Everything that what models say of an axis' pictures depends on, apart from axis, model and part.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct AxisSettings {
    /// How pictures are drawn and scored: raised when either changes.
    pub axes: u32,
    /// How the models were taught.
    #[serde(flatten)]
    pub teaching: TeachingSettings,
    /// Pictures of each part and axis.
    pub axis_views: u32,
    /// Edge points that model S compares at each pose of its search, where they are not as taught.
    pub search_points: Option<u32>,
}

impl AxisSettings {
    /// The pictures and their scoring of this version.
    pub const AXES: u32 = 1;
}

/// Everything that attempts under errors depend on, apart from the error, model and part.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct GraspSettings {
    /// Which errors, and how large: raised when they change.
    pub errors: u32,
    /// How the models were taught.
    #[serde(flatten)]
    pub teaching: TeachingSettings,
    /// Attempts of each model on each part under each error.
    pub attempts: u32,
    /// Edge points that model S compares at each pose of its search, where they are not as taught.
    pub search_points: Option<u32>,
}

impl GraspSettings {
    /// The errors of this version.
    pub const ERRORS: u32 = 1;
}
