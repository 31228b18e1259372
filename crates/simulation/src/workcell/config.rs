//! The configuration of a workcell.

use sdg_geometry::PinholeCamera;
use sdg_kinematics::collision::Obstacle;
use sdg_robot::CameraPose;

use crate::attempt_errors::AttemptErrors;
use crate::render::RenderConfig;
use crate::scene::{SceneVariation, SeenPart};

/// The contents of a workcell.
#[derive(Debug, Clone)]
pub struct WorkcellConfig {
    /// Part, light, table and distractors.
    pub scene: SceneVariation,
    /// How the wrist camera's pictures are drawn.
    pub wrist_render: RenderConfig,
    /// Errors of the workcell during attempts.
    pub errors: AttemptErrors,
    /// The camera's size, focal length and lens, if they differ from [`PinholeCamera::WRIST`].
    pub wrist_camera: Option<PinholeCamera>,
    /// A part that a camera has seen, which is drawn but has no collisions.
    pub seen_part: Option<SeenPart>,
    /// The camera's pose, if it differs from the MJCF's on the hand.
    pub camera_pose: Option<CameraPose>,
    /// Obstacles in the cell besides the table.
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
            camera_pose: None,
            obstacles: Vec::new(),
        }
    }
}
