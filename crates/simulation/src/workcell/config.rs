//! The configuration of a workcell.

use nalgebra::Isometry3;
use sdg_geometry::PinholeCamera;
use sdg_kinematics::collision::Obstacle;

use crate::attempt_errors::AttemptErrors;
use crate::render::RenderConfig;
use crate::scene::{SceneVariation, SeenPart};

/// What a workcell is made of.
#[derive(Debug, Clone)]
pub struct WorkcellConfig {
    /// Part, light, table and distractors.
    pub scene: SceneVariation,
    /// How the wrist camera's pictures are drawn.
    pub wrist_render: RenderConfig,
    /// Errors of the workcell during attempts.
    pub errors: AttemptErrors,
    /// The camera's size, focal length and lens, where they are not those of [`PinholeCamera::WRIST`].
    pub wrist_camera: Option<PinholeCamera>,
    /// A part that a camera has seen, to be drawn and not to be touched.
    pub seen_part: Option<SeenPart>,
    /// Where the camera is, if not in the MJCF's place on the hand.
    pub camera_place: Option<CameraPlace>,
    /// What stands in the cell besides the table.
    pub obstacles: Vec<Obstacle>,
}

impl WorkcellConfig {
    /// A scene with the wrist camera's default pictures, without errors.
    pub fn new(scene: SceneVariation) -> Self {
        Self {
            scene,
            wrist_render: RenderConfig::default(),
            errors: AttemptErrors::default(),
            wrist_camera: None,
            seen_part: None,
            camera_place: None,
            obstacles: Vec::new(),
        }
    }
}

/// Where a workcell's camera is (optical frame), m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum CameraPlace {
    /// On the robot's flange.
    OnFlange(Isometry3<f64>),
    /// Beside the robot, in its base frame.
    InBase(Isometry3<f64>),
}
