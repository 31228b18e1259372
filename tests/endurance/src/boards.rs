//! Pictures of the calibration board, rendered as in the tests of crate calibration.

use std::fs;
use std::path::Path;

use anyhow::Result;
use sdg_calibration::CalibratedCamera;

use crate::rendering::cameras::{CAMERAS, board, poses};
use crate::rendering::{Exposure, Random, render};

/// Writes `0.png` to `7.png`, `table.png` and the camera that took them, `camera.yaml`, unless they exist.
///
/// # Errors
/// A folder that cannot be written.
pub fn write_once(folder: &Path) -> Result<()> {
    let camera_file = folder.join("camera.yaml");
    if camera_file.exists() {
        return Ok(());
    }
    fs::create_dir_all(folder)?;
    let (_, camera) = &CAMERAS[0];
    let mut random = Random(29);
    for (idx, pose) in poses(camera).iter().take(8).enumerate() {
        let picture = render(&board(), camera, pose, &Exposure::ORDINARY, &mut random);
        picture.save(folder.join(format!("{idx}.png")))?;
        if idx == 0 {
            picture.save(folder.join("table.png"))?;
        }
    }
    let camera =
        CalibratedCamera { name: "known".to_owned(), intrinsics: *camera, table: None, flange_from_camera: None };
    fs::write(camera_file, camera.to_yaml())?;
    Ok(())
}
