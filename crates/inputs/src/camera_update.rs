//! A camera file that gets new intrinsics.

use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use sdg_calibration::{CalibratedCamera, UNCALIBRATED};
use sdg_geometry::PinholeCamera;

use crate::camera_files::{MAX_BYTES, text_of};

/// Name of a camera in a new file.
const DEFAULT_NAME: &str = "camera";

/// The file to write. Comments and unknown fields of an existing file are kept.
#[derive(Debug, Clone)]
pub struct CameraUpdate {
    path: PathBuf,
    existing: String,
    old: Option<CalibratedCamera>,
}

impl CameraUpdate {
    /// Checks, before minutes of work, that the file can be written, and updated if it exists. The file is not
    /// registered as an input: it is read again when it is written.
    ///
    /// # Errors
    /// The file cannot be written, or exists and cannot be read, is not text or does not have a camera file's layout.
    pub fn check(path: &Path) -> Result<()> {
        sdg_files::check_writable(path)?;
        let text = match fs::read(path) {
            Ok(bytes) => text_of(path, bytes)?,
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(()),
            Err(error) => return Err(error).with_context(|| path.display().to_string()),
        };
        let any = without_pose(DEFAULT_NAME.to_owned(), PinholeCamera::symmetric(640, 480, 500.0));
        if !text.trim().is_empty() {
            any.update_yaml(&text).with_context(|| path.display().to_string())?;
        }
        Ok(())
    }

    /// Reads the existing file, if there is one.
    ///
    /// # Errors
    /// The file cannot be read or is not text, or is an input of this process.
    pub fn read(path: &Path) -> Result<Self> {
        // The board and the pictures are inputs, which must not be replaced; the camera file itself may be updated.
        sdg_files::check_writable(path)?;
        let existing = match fs::exists(path) {
            Ok(true) => text_of(path, sdg_files::read(path, MAX_BYTES)?)?,
            _ => String::new(),
        };
        Ok(Self { path: path.to_owned(), old: CalibratedCamera::from_yaml(&existing).ok(), existing })
    }

    /// Whether the existing file contains a pose, which was measured with the old intrinsics and is removed.
    pub fn removes_pose(&self) -> bool {
        self.old.as_ref().is_some_and(|old| old.table.is_some() || old.flange_from_camera.is_some())
    }

    /// Writes the file. Without a `name`, the existing name is kept.
    ///
    /// # Errors
    /// A camera file with these intrinsics could not be read, the existing file cannot be updated, or the file cannot
    /// be written.
    pub fn write(self, intrinsics: PinholeCamera, name: Option<String>) -> Result<()> {
        let Self { path, existing, old } = self;
        // A calibration replaces an estimate, whose name says that it is one.
        let old_name = old.map(|old| old.name).filter(|name| name != UNCALIBRATED);
        let name = name.or(old_name).unwrap_or_else(|| DEFAULT_NAME.to_owned());
        let camera = without_pose(name, intrinsics);
        // A fitted lens may fold the picture, and then every command refuses the file.
        CalibratedCamera::from_yaml(&camera.to_yaml()).with_context(|| path.display().to_string())?;
        let text = if existing.trim().is_empty() {
            camera.to_yaml()
        } else {
            camera.update_yaml(&existing).with_context(|| path.display().to_string())?
        };
        Ok(sdg_files::extend(&path, Some(&path), text.as_bytes())?)
    }
}

fn without_pose(name: String, intrinsics: PinholeCamera) -> CalibratedCamera {
    CalibratedCamera { name, intrinsics, table: None, flange_from_camera: None }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sdg_geometry::PlumbBob;

    #[test]
    fn a_lens_that_folds_the_picture_is_not_written() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("camera.yaml");
        let good = PinholeCamera::symmetric(640, 480, 400.0);
        let folding = PinholeCamera { lens: PlumbBob { k1: -1.5, ..PlumbBob::NONE }, ..good };
        // An estimate's name does not remain.
        let estimated = folder.path().join("estimated.yaml");
        fs::write(&estimated, without_pose(UNCALIBRATED.to_owned(), good).to_yaml()).unwrap();
        CameraUpdate::read(&estimated).unwrap().write(good, None).unwrap();
        assert!(!fs::read_to_string(&estimated).unwrap().contains(UNCALIBRATED));
        let refusal = || format!("{:#}", CameraUpdate::read(&path).unwrap().write(folding, None).unwrap_err());
        let error = refusal();
        assert!(error.contains("fold the picture") && !path.exists(), "{error}");
        let text = without_pose("wrist".to_owned(), good).to_yaml();
        fs::write(&path, &text).unwrap();
        let error = refusal();
        assert!(error.contains("fold the picture"), "{error}");
        assert_eq!(fs::read_to_string(&path).unwrap(), text);
    }

    #[test]
    fn a_file_that_cannot_be_updated_is_refused_before_the_work() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("camera.yaml");
        CameraUpdate::check(&path).unwrap();
        fs::write(&path, [0xff, 0xfe]).unwrap();
        let error = CameraUpdate::check(&path).unwrap_err().to_string();
        assert!(error.ends_with("expected YAML, found bytes that are not text"), "{error}");
    }
}
