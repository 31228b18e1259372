//! What the workcell asks of whoever looks at its pictures.

use nalgebra::Isometry3;

use crate::camera::CameraView;

/// Where the hand should close, as perception sees it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GraspTarget {
    /// Pose of the tool centre point when closing, in the base frame, metres: z into the table, y
    /// along the fingers' motion.
    pub base_from_tcp: Isometry3<f64>,
    /// Width of the part between the fingers, in metres.
    pub jaw_width_m: f64,
    /// How sure perception is, 0 to 1; 0.5 is where to decide.
    pub score: f64,
}

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
