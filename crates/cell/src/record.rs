//! A detection in JSON, as `sdg detect` prints it.

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

/// Where the gripper is to close; metres and degrees, the turn about the frame's z. The position lies within `sigma_mm` and
/// the turn within `sigma_deg` with a probability of 68 % each.
#[derive(Debug, Clone, Serialize)]
pub struct PoseRecord {
    /// The frame that the camera's file places the camera in.
    pub frame: Frame,
    /// Grasp point in that frame, in metres.
    pub p_m: [f64; 3],
    /// Turn about the frame's z, right-handed.
    pub yaw_deg: f64,
    /// Distance between the jaws for the part's width, in metres.
    pub opening_m: f64,
    /// Standard deviation of the position.
    pub sigma_mm: f64,
    /// Standard deviation of the turn.
    pub sigma_deg: f64,
}

impl FoundRecord {
    /// The record of what a detector found.
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
