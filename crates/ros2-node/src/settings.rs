//! What the node works with, read and checked before it joins.

use std::sync::Arc;

use sdg_grasp::{Device, GraspModel};
use sdg_ros2::dds::Qos;

use crate::camera_pose::CameraPoseSource;
use crate::teaching::{Teach, TeachJob};

/// Whether the node is to end, and an arm to stop.
pub type IsInterrupted = Arc<dyn Fn() -> bool + Send + Sync>;

/// A node's settings.
pub struct Settings {
    /// What it detects with, until another is taught.
    pub model: Option<GraspModel>,
    /// Where models compute.
    pub device: Device,
    /// Where the camera's pose comes from.
    pub camera_pose: CameraPoseSource,
    /// How old a transform may be beside the picture's stamp.
    pub max_transform_age_secs: f64,
    /// Detections with a lower score are not published.
    pub min_score: f64,
    /// Pictures that wait while one is searched.
    pub queue: usize,
    /// Whether pictures come as CompressedImage.
    pub is_compressed: bool,
    /// How the network hands over pictures.
    pub picture_qos: Qos,
    /// Teaches, in a thread of its own.
    pub teach: Arc<Teach>,
    /// What a Trigger teaches.
    pub trigger_teaching: Option<TeachJob>,
}
