//! One picture of the sheet on the table: the camera's pose.
//!
//! ```text
//! corners ─┬─ with intrinsics: the pose that minimises reprojection, its errors        sheet_pose.rs
//!          └─ without: homography, focal length if the tilt determines it, else a guess  focal.rs
//! ```
//! A homography alone gives positions on the table. For positions above the table the focal length matters;
//! [`FocalCost`] has the size of that effect.

mod focal;
mod sheet_pose;

pub use self::focal::{FocalCost, FocalEstimate, focal_cost, focal_from_sheet, homography_rms_px};
pub use self::sheet_pose::{SheetPose, locate_sheet};
