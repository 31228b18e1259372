//! The camera's pose from one picture of the sheet on the table.
//!
//! ```text
//! corners ─┬─ intrinsics known: the pose with the smallest reprojection error, and its uncertainty   sheet_pose.rs
//!          └─ unknown: homography; the focal length if the tilt determines it, else a guess   focal.rs, ../guessed.rs
//! ```
//! A homography alone gives positions on the table. Positions above the table depend on the focal length; [`FocalCost`]
//! states how much.

mod focal;
mod placement;
mod sheet_pose;

pub use self::focal::{FocalCost, FocalEstimate, focal_cost, focal_from_sheet, homography_rms_px};
pub use self::placement::SheetPlacement;
pub use self::sheet_pose::{SheetPose, locate_sheet};
