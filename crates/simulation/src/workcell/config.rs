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
    /// Rendering settings of the wrist camera's pictures.
    pub wrist_render: RenderConfig,
    /// Errors of the workcell during attempts.
    pub errors: AttemptErrors,
    /// Picture size, focal length and lens of the camera, if they differ from [`PinholeCamera::WRIST`].
    pub wrist_camera: Option<PinholeCamera>,
    /// A part that a camera detected; it is rendered but has no collisions.
    pub seen_part: Option<SeenPart>,
    /// The camera's pose, if it differs from the pose on the hand in the MJCF.
    pub camera_pose: Option<CameraPose>,
    /// Obstacles in the cell besides the table.
    pub obstacles: Vec<Obstacle>,
    /// The table's z in the base frame, in metres, for drawings of plans. The objects of the scene, and the judgement of
    /// attempts, are for a table at 0.
    pub table_height_m: f64,
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
            table_height_m: 0.0,
        }
    }
}
