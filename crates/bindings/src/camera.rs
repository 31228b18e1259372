//! A calibrated camera and its pose.

use std::path::Path;
use std::sync::Arc;

use anyhow::Context;
use sdg_calibration::CalibratedCamera;
use sdg_cell::camera_over_table;
use sdg_inputs::camera_files;

use crate::fault::{Fault, FaultKind, Result};

/// A calibrated camera with its pose relative to the table; cheap to clone.
#[derive(Debug, Clone)]
pub struct Camera(Arc<CalibratedCamera>);

impl Camera {
    /// Reads a camera file: ROS camera_info YAML, with `table:` for the camera's pose.
    ///
    /// # Errors
    /// The file cannot be read, is not a camera file, or has no pose of the camera.
    pub fn read(path: &Path) -> Result<Self> {
        let read = || {
            let (camera, _) = camera_files::read(path)?;
            camera_over_table(&camera).with_context(|| path.display().to_string())?;
            Ok(Self(Arc::new(camera)))
        };
        read().map_err(Fault::of_kind_or(FaultKind::Camera))
    }

    /// Reads a camera from the text of a file.
    ///
    /// # Errors
    /// The text is not a camera file, or has no pose of the camera.
    pub fn from_yaml(text: &str) -> Result<Self> {
        let read = || {
            let camera = CalibratedCamera::from_yaml(text)?;
            camera_over_table(&camera)?;
            Ok(camera)
        };
        read().map(|camera| Self(Arc::new(camera))).map_err(Fault::of_kind(FaultKind::Camera))
    }

    /// Width and height of the camera's pictures, in pixels.
    pub fn size_px(&self) -> [u32; 2] {
        [self.0.intrinsics.width, self.0.intrinsics.height]
    }

    /// The frame of the camera's poses: `table` or `base`.
    pub fn frame(&self) -> Option<&'static str> {
        self.0.table.as_ref().map(|table| table.frame.name())
    }

    pub(crate) fn calibrated(&self) -> &CalibratedCamera {
        &self.0
    }

    pub(crate) fn is_same(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }
}
