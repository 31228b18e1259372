//! Files of robot poses, with the pictures that were taken at them.

use std::path::Path;

use anyhow::{Context, Result, bail};
use rayon::prelude::*;
use sdg_calibration::{Board, CalibratedCamera, HandEyeView, RobotPose, read_robot_poses};

use crate::board_pictures::BoardPicture;

/// Maximum size of a poses file.
const MAX_BYTES: u64 = 4 << 20;

/// Reads a file of robot poses (YAML, JSON or CSV).
///
/// # Errors
/// The file cannot be read.
pub fn read(path: &Path) -> Result<Vec<RobotPose>> {
    let bytes = sdg_files::read(path, MAX_BYTES)?;
    let name = path.display().to_string();
    read_robot_poses(&name, &String::from_utf8_lossy(&bytes)).with_context(|| name.clone())
}

/// Checks that the pictures, named relative to `folder`, exist. A missing picture is an error in the poses file, unlike
/// a picture without the board.
///
/// # Errors
/// A picture does not exist.
pub fn check_pictures_exist(poses: &[RobotPose], folder: &Path) -> Result<()> {
    match poses.iter().map(|pose| folder.join(&pose.picture)).find(|picture| !picture.exists()) {
        Some(missing) => bail!("{}: expected the picture of a robot pose, found no such file", missing.display()),
        None => Ok(()),
    }
}

/// Finds the board in each pose's picture, in parallel and in order.
pub fn views<'a>(
    poses: &'a [RobotPose],
    folder: &Path,
    camera: &CalibratedCamera,
    board: &Board,
) -> Vec<(&'a RobotPose, Result<HandEyeView>)> {
    let view = |pose: &RobotPose| -> Result<HandEyeView> {
        let BoardPicture { corners, .. } = BoardPicture::read(&folder.join(&pose.picture), board, Some(camera))?;
        Ok(HandEyeView { base_from_flange: pose.base_from_flange, corners })
    };
    poses.par_iter().map(|pose| (pose, view(pose))).collect()
}
