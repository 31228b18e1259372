//! The JSON record of a detection, as printed by `sdg detect`.

use sdg_calibration::Frame;
use sdg_grasp::DetectionRecord;
use serde::Serialize;

use crate::perception::{Found, Perception};

/// A detection and, with a camera, its pose.
#[derive(Debug, Clone, Serialize)]
pub struct FoundRecord {
    /// In pixels.
    #[serde(flatten)]
    pub detection: DetectionRecord,
    /// In metres; absent without a calibrated camera.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pose: Option<PoseRecord>,
}

/// Pose of the grasp in metres and degrees; the rotation is about the frame's z. The position is within `sigma_mm` and
/// the rotation within `sigma_deg` with a probability of 68 % each.
#[derive(Debug, Clone, Serialize)]
pub struct PoseRecord {
    /// The frame of the pose in the camera's file.
    pub frame: Frame,
    /// Grasp point in that frame, in metres.
    pub p_m: [f64; 3],
    /// Rotation about the frame's z, right-handed.
    pub yaw_deg: f64,
    /// Distance between the jaws for the part's width, in metres.
    pub opening_m: f64,
    /// Standard deviation of the position.
    pub sigma_mm: f64,
    /// Standard deviation of the rotation.
    pub sigma_deg: f64,
}

impl FoundRecord {
    /// The record of a detection.
    pub fn new(found: &Found, detector: &Perception) -> Self {
        let pose = found.pose.as_ref().zip(detector.frame()).map(|(pose, frame)| PoseRecord {
            frame,
            p_m: pose.position_m.coords.into(),
            yaw_deg: pose.yaw.degrees(),
            opening_m: pose.opening_m,
            sigma_mm: 1e3 * pose.uncertainty.position_m,
            sigma_deg: pose.uncertainty.yaw_rad.to_degrees(),
        });
        Self { detection: DetectionRecord::new(&found.detection, detector.model().kind()), pose }
    }
}
