//! A calibrated camera on or beside an arm.

use nalgebra::Isometry3;
use sdg_calibration::{CalibratedCamera, Frame};
use sdg_geometry::{Mount, PinholeCamera, PosedCamera};
use sdg_grasp::CameraOverTable;
use sdg_robot::CameraPose;

use crate::error::{CellError, Result};

/// A calibrated camera and its mount.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MountedCamera {
    /// The intrinsics and picture size.
    pub intrinsics: PinholeCamera,
    /// The pose relative to the mount.
    pub pose: CameraPose,
    /// The table's z in the robot's base frame, in metres, or z of the surface under the parts after
    /// [`Self::with_marks_at`].
    pub table_height_m: f64,
}

impl MountedCamera {
    /// The camera of a file, mounted as the workcell defines.
    ///
    /// # Errors
    /// [`CellError::NotOnHand`] or [`CellError::NotInBase`] if the file lacks the pose for this mount.
    pub fn new(camera: &CalibratedCamera, mount: Mount, table_height_m: f64) -> Result<Self> {
        let pose = match (mount, camera.flange_from_camera, &camera.table) {
            (Mount::Hand, Some(flange_from_camera), _) => CameraPose::OnFlange(flange_from_camera),
            (Mount::Hand, None, _) => return Err(CellError::NotOnHand),
            (Mount::Base, _, Some(table)) if table.frame == Frame::Base => CameraPose::InBase(table.frame_from_camera),
            (Mount::Base, ..) => return Err(CellError::NotInBase),
        };
        Ok(Self { intrinsics: camera.intrinsics, pose, table_height_m })
    }

    /// Width and height of the pictures, in pixels.
    pub fn size_px(&self) -> [u32; 2] {
        [self.intrinsics.width, self.intrinsics.height]
    }

    /// The camera above the table, in the robot's base frame, with the flange at `base_from_flange`.
    pub fn over_table(&self, base_from_flange: &Isometry3<f64>) -> CameraOverTable {
        let world_from_camera = match self.pose {
            CameraPose::OnFlange(flange_from_camera) => base_from_flange * flange_from_camera,
            CameraPose::InBase(base_from_camera) => base_from_camera,
        };
        let camera = PosedCamera { intrinsics: self.intrinsics, world_from_camera };
        CameraOverTable { camera, table_height_m: self.table_height_m, workspace: None }
    }
}
