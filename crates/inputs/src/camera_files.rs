//! Files of calibrated cameras.

use std::path::Path;

use anyhow::{Context, Result, anyhow};
use image::RgbImage;
use sdg_calibration::CalibratedCamera;
use sdg_cell::{CellError, MountedCamera, Perception, camera_over_table};
use sdg_demonstration::Demonstration;
use sdg_geometry::PinholeCamera;
use sdg_grasp::{CameraOverTable, GraspError, GraspModel, Lengths, pictures_from_above, seen_from_above};
use sdg_robot::workcell::Workcell;

/// Maximum size of a camera file.
pub(crate) const MAX_BYTES: u64 = 1 << 20;

/// A camera file with the camera's pose above the table.
#[derive(Debug, Clone)]
pub struct CameraFile {
    camera: CalibratedCamera,
    /// The camera with its pose above the table.
    pub over_table: CameraOverTable,
}

impl CameraFile {
    /// Reads the intrinsics of a file, with or without the camera's pose.
    ///
    /// # Errors
    /// The file cannot be read.
    pub fn read_intrinsics(path: &Path) -> Result<PinholeCamera> {
        Ok(read(path)?.0.intrinsics)
    }

    /// Reads a camera file with the camera's pose above the table.
    ///
    /// # Errors
    /// The file cannot be read or has no such pose.
    pub fn read(path: &Path) -> Result<Self> {
        let (camera, _) = read(path)?;
        let (over_table, _) = camera_over_table(&camera).with_context(|| path.display().to_string())?;
        Ok(Self { over_table, camera })
    }

    /// The perception of a model with this camera.
    ///
    /// # Errors
    /// The model was taught without a camera, the camera does not see the plane of the marks, or the model's region is
    /// not inside the camera's pictures.
    pub fn perception(&self, model: GraspModel) -> Result<Perception> {
        Ok(Perception::calibrated(model, &self.camera)?)
    }

    /// Width and height of the pictures.
    pub fn size_px(&self) -> [u32; 2] {
        [self.camera.intrinsics.width, self.camera.intrinsics.height]
    }

    /// Checks that a picture can be from this camera.
    ///
    /// # Errors
    /// The picture has a different size.
    pub fn check_picture(&self, picture: &RgbImage) -> Result<()> {
        self.check_size(picture.dimensions())
    }

    /// Like [`Self::check_picture`], for a width and a height.
    ///
    /// # Errors
    /// The size is different.
    pub fn check_size(&self, size: (u32, u32)) -> Result<()> {
        Ok(self.camera.check_picture(size)?)
    }

    /// Photos of this camera and their marks, in the plan view of the marks' plane. The heights are above the table, in
    /// metres.
    ///
    /// # Errors
    /// A photo has a different size, or marks are outside the visible part of the plane.
    pub fn seen_from_above(
        &self,
        photos: &[Demonstration],
        mark_height_m: f64,
        grasp_height_m: f64,
    ) -> Result<(Vec<Demonstration>, Lengths)> {
        photos.iter().try_for_each(|photo| self.check_picture(&photo.image))?;
        Ok(seen_from_above(photos, &self.over_table, mark_height_m, grasp_height_m)?)
    }

    /// Pictures of this camera without the part, in the same plan view as the photos.
    ///
    /// # Errors
    /// The size of a picture is not the camera's.
    pub fn pictures_from_above(&self, pictures: &[RgbImage], lengths: &Lengths) -> Result<Vec<RgbImage>> {
        pictures.iter().try_for_each(|picture| self.check_picture(picture))?;
        Ok(pictures_from_above(pictures, &self.over_table, lengths)?)
    }
}

/// The perception of a model file, with a camera file if one is given.
///
/// # Errors
/// The camera file cannot be used, or the camera does not see the plane of the marks (with the camera file's name); or
/// the model was taught without a camera, or its region is outside the pictures (with the model file's name).
pub fn perception(model: GraspModel, model_file: &Path, camera: Option<&Path>) -> Result<Perception> {
    let Some(path) = camera else { return Ok(Perception::of_any_camera(model)) };
    CameraFile::read(path)?.perception(model).map_err(|error| {
        // A plane that is not visible is an error of the camera file.
        let is_of_camera = matches!(error.downcast_ref(), Some(CellError::Grasp(GraspError::PlanView(_))));
        let file = if is_of_camera { path } else { model_file };
        error.context(file.display().to_string())
    })
}

/// The camera of a file, mounted as the workcell defines.
///
/// # Errors
/// The file lacks the pose for this mounting.
pub fn mounted(camera: &CalibratedCamera, workcell: &Workcell, path: &Path) -> Result<MountedCamera> {
    MountedCamera::new(camera, workcell.mount, workcell.table_height_m).with_context(|| path.display().to_string())
}

/// The text of a camera file.
///
/// # Errors
/// The bytes are not UTF-8.
pub fn text_of(path: &Path, bytes: Vec<u8>) -> Result<String> {
    String::from_utf8(bytes).map_err(|_| anyhow!("{}: expected YAML, found bytes that are not text", path.display()))
}

/// Reads a camera file, with or without a pose. Returns the camera, and the text for rewriting the file.
pub fn read(path: &Path) -> Result<(CalibratedCamera, String)> {
    let text = text_of(path, sdg_files::read(path, MAX_BYTES)?)?;
    let camera = CalibratedCamera::from_yaml(&text).with_context(|| path.display().to_string())?;
    Ok((camera, text))
}
