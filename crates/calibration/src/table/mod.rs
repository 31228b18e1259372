//! One picture of the sheet on the table: where the camera is.
//!
//! ```text
//! corners ─┬─ with intrinsics: the pose that minimises reprojection, its errors        sheet_pose.rs
//!          └─ without: homography, focal length where the tilt tells it, else a guess  focal.rs
//! ```
//! A homography alone says what lies where on the table. For what stands above the table the focal length counts;
//! [`FocalCost`] has the size of that effect.

mod focal;
mod sheet_pose;

pub use self::focal::{FocalCost, FocalEstimate, focal_cost, focal_from_sheet, homography_rms_px};
pub use self::sheet_pose::{SheetPose, locate_sheet};
