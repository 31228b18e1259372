//! The height of parts: measured by a camera on the hand, or given.

use sdg_grasp::GraspModel;
use sdg_robot::CameraPose;
use sdg_robot::height::{GivenHeight, HeightMeasurement};

use crate::mounted_camera::MountedCamera;

/// The settings for measuring a part's height; `None` unless the camera is on the hand and the model knows lengths.
/// `told` is the given z of the marks in the base frame, in metres.
pub fn height_measurement(
    model: &GraspModel,
    camera: &MountedCamera,
    told: Option<GivenHeight>,
) -> Option<HeightMeasurement> {
    let lengths = model.facts().lengths.as_ref()?;
    let measurement = HeightMeasurement::new(lengths.mark_height_m, lengths.grasp_height_m);
    matches!(camera.pose, CameraPose::OnFlange(_)).then_some(HeightMeasurement { told, ..measurement })
}

impl MountedCamera {
    /// For a camera beside the robot: replaces the model's height above the table by the given height of the marks (z
    /// in the base frame, in metres). A camera on the hand measures the height instead.
    pub fn with_marks_at(self, model: &GraspModel, told: Option<&GivenHeight>) -> Self {
        match (self.pose, &model.facts().lengths, told) {
            (CameraPose::InBase(_), Some(lengths), Some(told)) => {
                Self { table_height_m: told.height_m - lengths.mark_height_m, ..self }
            }
            _ => self,
        }
    }

    /// z of the surface under the parts (base frame, in metres) as a camera beside the robot assumes it; `None` for a
    /// camera on the hand, which measures it.
    pub fn assumed_surface_m(&self) -> Option<f64> {
        matches!(self.pose, CameraPose::InBase(_)).then_some(self.table_height_m)
    }
}
