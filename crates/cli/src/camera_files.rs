//! `--camera FILE`: a calibrated camera over a table.

use std::path::Path;

use anyhow::{Context, Result, bail};
use image::RgbImage;
use sdg_calibration::{CalibratedCamera, Frame};
use sdg_grasp::CameraOverTable;

use crate::files;

/// Larger camera files than any tool writes.
const MAX_BYTES: u64 = 1 << 20;

/// A camera's file, read.
pub struct CameraFile {
    camera: CalibratedCamera,
    /// What the camera's world is.
    pub frame: Frame,
    /// Where the camera is.
    pub over_table: CameraOverTable,
}

impl CameraFile {
    /// Reads a file that has the camera's pose.
    pub fn read(path: &Path) -> Result<Self> {
        let (camera, _) = read(path)?;
        let (posed, table) = camera.posed().with_context(|| path.display().to_string())?;
        let over_table = CameraOverTable { camera: posed, table_height_m: table.height_m, workspace: table.workspace };
        Ok(Self { frame: table.frame, over_table, camera })
    }

    /// Whether a picture can be this camera's.
    pub fn check_picture(&self, picture: &RgbImage) -> Result<()> {
        Ok(self.camera.check_picture(picture.dimensions())?)
    }
}

/// Reads a camera's file, with or without the camera's pose: the camera, and the text for whom writes it again.
pub fn read(path: &Path) -> Result<(CalibratedCamera, String)> {
    let bytes = files::read(path, MAX_BYTES)?;
    let Ok(text) = String::from_utf8(bytes) else {
        bail!("{}: expected YAML, found bytes that are no text", path.display());
    };
    let camera = CalibratedCamera::from_yaml(&text).with_context(|| path.display().to_string())?;
    Ok((camera, text))
}
