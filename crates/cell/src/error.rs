//! Errors of perception in a cell.

use sdg_calibration::CameraFileError;
use sdg_grasp::GraspError;
use sdg_robot::RobotError;

/// Result of this crate.
pub type Result<T> = std::result::Result<T, CellError>;

/// Why a cell's perception cannot be set up, or cannot look.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CellError {
    /// The model refuses.
    #[error(transparent)]
    Grasp(#[from] GraspError),
    /// The camera's pose is not known, or a picture is not the camera's.
    #[error(transparent)]
    Camera(#[from] CameraFileError),
    /// The workcell mounts the camera on the hand, and nothing says where on it.
    #[error("expected hand_eye: flange_from_camera, since the workcell mounts the camera on the hand")]
    NotOnHand,
    /// The workcell mounts the camera beside the robot, and nothing says where in the robot's base.
    #[error("expected table: with frame: base, since the workcell mounts the camera beside the robot")]
    NotInBase,
    /// The thread that searches.
    #[error("the search thread {0}")]
    SearchThread(&'static str),
}

impl From<CellError> for RobotError {
    fn from(error: CellError) -> Self {
        Self::Perception(error.to_string())
    }
}
