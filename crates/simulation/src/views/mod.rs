//! Pictures of scenes with the truth: demonstrations, random places, axes that make them harder, other cameras.
//!
//! A scene contains no camera and no robot; a view draws it through a workcell.

mod axis;
mod nominal;
mod other_camera;

pub use axis::{Axis, AxisParameter, AxisView, InstanceTruth, PICTURES_PER_AXIS, axis_view};
pub(crate) use nominal::shows_whole;
pub use nominal::{
    DEMONSTRATION_PLACE, DemonstrationView, GraspTruth, TestView, base_from_look_camera, demonstration_view,
    in_picture, test_view, test_views,
};
pub use other_camera::{OTHER_CAMERAS, OnTable, OtherCamera, OtherView, other_view};
