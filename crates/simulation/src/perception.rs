//! The trait by which the workcell asks for a grasp in its pictures.

use sdg_robot::GraspTarget;

use crate::camera::CameraView;

/// Finds the grasp of the taught part in a picture.
pub trait Perception {
    /// The best grasp in the picture, sure or not; `None` where nothing is seen.
    ///
    /// # Errors
    /// Where perception could not do its work at all; the attempt is given up with this error.
    fn perceive(
        &mut self,
        view: &CameraView,
    ) -> std::result::Result<Option<GraspTarget>, Box<dyn std::error::Error + Send + Sync>>;
}

impl<F> Perception for F
where
    F: FnMut(&CameraView) -> std::result::Result<Option<GraspTarget>, Box<dyn std::error::Error + Send + Sync>>,
{
    fn perceive(
        &mut self,
        view: &CameraView,
    ) -> std::result::Result<Option<GraspTarget>, Box<dyn std::error::Error + Send + Sync>> {
        self(view)
    }
}
