//! The place of the sheet in the frame of the table or of the robot's base.

use nalgebra::{Isometry3, UnitQuaternion, Vector3};

use super::sheet_pose::SheetPose;
use crate::camera_file::{CalibratedCamera, Frame, TablePose};

/// A sheet that lies on the table.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SheetPlacement {
    /// The frame of the other fields.
    pub frame: Frame,
    /// The sheet's origin, in metres.
    pub origin_m: Vector3<f64>,
    /// Rotation of the sheet about z.
    pub yaw_rad: f64,
    /// The table's z, in metres.
    pub table_height_m: f64,
}

impl SheetPlacement {
    /// The camera with its pose above the table, from its pose above the sheet. The workspace is kept if it is in the
    /// same frame.
    pub fn place(&self, camera: CalibratedCamera, sheet: &SheetPose) -> CalibratedCamera {
        let rotation = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), self.yaw_rad);
        let frame_from_sheet = Isometry3::from_parts(self.origin_m.into(), rotation);
        let old = camera.table.as_ref().filter(|table| table.frame == self.frame);
        let table = TablePose {
            frame: self.frame,
            height_m: self.table_height_m,
            frame_from_camera: frame_from_sheet * sheet.sheet_from_camera,
            workspace: old.and_then(|table| table.workspace),
        };
        CalibratedCamera { table: Some(table), ..camera }
    }
}
