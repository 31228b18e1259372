//! Models that are taught in the plan view of one calibrated camera, and tested on pictures of this and other cameras:
//! grasps in metres, compared with the ground truth.
//!
//! ```text
//! shipped photo and its camera ─ plan view ─ teach ┐
//! three other cameras ┐                            ├─ PlanViewDetector ─ error in mm and degrees, and the predicted error
//! the axes' pictures  ├─ picture and its camera ───┘
//! parts of other sizes┘
//! ```
//! Models and results are in the same store as those of the axes.

mod files;
mod records;
mod sets;
mod summary;
mod tables;
mod units;

pub use super::teaching::MAX_PHOTOS;
pub use records::{CameraPicture, CameraRecord, MetricAnswer};
pub use sets::PictureSet;
pub use summary::{CamerasSummary, ErrorFigures, SetFigures};
pub use tables::{markdown, page, tables};
pub use units::CamerasEvaluation;
