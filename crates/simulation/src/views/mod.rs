//! Pictures of scenes with ground truth: demonstrations, random scenes, harder scenes along axes, other cameras.
//!
//! A scene contains no camera and no robot; a view renders it in a workcell.

mod axis;
mod nominal;
mod other_camera;
mod seed;
mod tilted;

pub use axis::{Axis, AxisParameter, AxisView, InstanceTruth, PICTURES_PER_AXIS, axis_stratum, axis_view};
pub(crate) use nominal::shows_whole;
pub use nominal::{
    DEMONSTRATION_PLACE, DemonstrationView, GraspTruth, TestView, base_from_look_camera, demonstration_view,
    demonstration_view_at, in_picture, test_view, test_views,
};
pub use other_camera::{OTHER_CAMERAS, OnTable, OtherCamera, OtherView, other_view};
