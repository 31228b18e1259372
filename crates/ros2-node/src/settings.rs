//! The node's settings, read and checked before it joins ROS 2.

use std::sync::Arc;

use sdg_grasp::{Device, GraspModel};
use sdg_ros2::dds::Qos;

use crate::camera_pose::CameraPoseSource;
use crate::teaching::{Teach, TeachJob};

/// Returns whether the node must end and an arm must stop.
pub type IsInterrupted = Arc<dyn Fn() -> bool + Send + Sync>;

/// A node's settings.
pub struct Settings {
    /// The model for detection, until another one is taught.
    pub model: Option<GraspModel>,
    /// Device of the models.
    pub device: Device,
    /// Source of the camera's pose.
    pub camera_pose: CameraPoseSource,
    /// Maximum difference between the stamps of picture and nearest transform, in seconds.
    pub max_transform_age_secs: f64,
    /// Minimum score of published detections.
    pub min_score: f64,
    /// Maximum number of queued pictures.
    pub queue: usize,
    /// Whether pictures arrive as CompressedImage.
    pub is_compressed: bool,
    /// Quality of service of the picture subscription.
    pub picture_qos: Qos,
    /// The function that teaches; it runs on a separate thread.
    pub teach: Arc<Teach>,
    /// Settings of teaching by the Trigger service.
    pub trigger_teaching: Option<TeachJob>,
}
