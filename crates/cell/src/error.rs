//! The errors of this crate.

use sdg_calibration::CameraFileError;
use sdg_grasp::GraspError;
use sdg_robot::RobotError;

/// The result type of this crate.
pub type Result<T> = std::result::Result<T, CellError>;

/// The reason why perception cannot be set up, or why a search fails.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CellError {
    /// Error of the model.
    #[error(transparent)]
    Grasp(#[from] GraspError),
    /// The camera's pose is unknown, or a picture is not from this camera.
    #[error(transparent)]
    Camera(#[from] CameraFileError),
    /// The workcell mounts the camera on the hand, but the camera file has no pose relative to the hand.
    #[error("expected hand_eye: flange_from_camera, since the workcell mounts the camera on the hand")]
    NotOnHand,
    /// The workcell mounts the camera beside the robot, but the camera file has no pose in the robot's base frame.
    #[error("expected table: with frame: base, since the workcell mounts the camera beside the robot")]
    NotInBase,
    /// The search thread failed.
    #[error("the search thread {0}")]
    SearchThread(&'static str),
}

impl From<CellError> for RobotError {
    fn from(error: CellError) -> Self {
        Self::Perception(error.to_string())
    }
}
