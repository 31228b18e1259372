//! `--camera FILE`: a calibrated camera over a table.

use std::path::Path;

use anyhow::{Context, Result, bail};
use image::RgbImage;
use sdg_calibration::{CalibratedCamera, Frame};
use sdg_demonstration::Demonstration;
use sdg_geometry::PinholeCamera;
use sdg_grasp::{CameraOverTable, Lengths, pictures_from_above, seen_from_above};

use crate::files;

/// Larger camera files than any tool writes.
const MAX_BYTES: u64 = 1 << 20;

/// A camera's file, read.
#[derive(Debug, Clone)]
pub struct CameraFile {
    camera: CalibratedCamera,
    /// What the camera's world is.
    pub frame: Frame,
    /// Where the camera is.
    pub over_table: CameraOverTable,
}

impl CameraFile {
    /// Reads the intrinsics of a file, with or without the camera's pose.
    ///
    /// # Errors
    /// A file that cannot be read.
    pub fn read_intrinsics(path: &Path) -> Result<PinholeCamera> {
        Ok(read(path)?.0.intrinsics)
    }

    /// Reads a file that has the camera's pose.
    ///
    /// # Errors
    /// A file that cannot be read or has no pose.
    pub fn read(path: &Path) -> Result<Self> {
        let (camera, _) = read(path)?;
        let (posed, table) = camera.posed().with_context(|| path.display().to_string())?;
        let over_table = CameraOverTable { camera: posed, table_height_m: table.height_m, workspace: table.workspace };
        Ok(Self { frame: table.frame, over_table, camera })
    }

    /// Width and height of its pictures.
    pub fn size_px(&self) -> [u32; 2] {
        [self.camera.intrinsics.width, self.camera.intrinsics.height]
    }

    /// Whether a picture can be this camera's.
    ///
    /// # Errors
    /// A picture of another size.
    pub fn check_picture(&self, picture: &RgbImage) -> Result<()> {
        Ok(self.camera.check_picture(picture.dimensions())?)
    }

    /// Photos of this camera and their marks in the plan view of the marks' plane; heights over the table in metres.
    ///
    /// # Errors
    /// A photo of another size, and marks outside what the camera sees of the plane.
    pub fn seen_from_above(
        &self,
        photos: &[Demonstration],
        mark_height_m: f64,
        grasp_height_m: f64,
    ) -> Result<(Vec<Demonstration>, Lengths)> {
        photos.iter().try_for_each(|photo| self.check_picture(&photo.image))?;
        Ok(seen_from_above(photos, &self.over_table, mark_height_m, grasp_height_m)?)
    }

    /// Pictures of this camera without the part in the same plan view.
    ///
    /// # Errors
    /// A picture of another size than the camera's.
    pub fn pictures_from_above(&self, pictures: &[RgbImage], lengths: &Lengths) -> Result<Vec<RgbImage>> {
        pictures.iter().try_for_each(|picture| self.check_picture(picture))?;
        Ok(pictures_from_above(pictures, &self.over_table, lengths)?)
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
