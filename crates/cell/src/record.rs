//! The JSON record of a detection, as printed by `sdg detect`.

use sdg_calibration::Frame;
use sdg_grasp::DetectionRecord;
use serde::Serialize;

use crate::perception::{Found, Perception};

/// A detection, and its pose if the camera is calibrated.
#[derive(Debug, Clone, Serialize)]
pub struct FoundRecord {
    /// The detection, in pixels.
    #[serde(flatten)]
    pub detection: DetectionRecord,
    /// The pose, in metres; absent without a calibrated camera.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pose: Option<PoseRecord>,
}

/// Pose of the grasp in metres and degrees.
#[derive(Debug, Clone, Serialize)]
pub struct PoseRecord {
    /// The frame of the pose, as named in the camera file.
    pub frame: Frame,
    /// Grasp point in that frame, in metres.
    pub p_m: [f64; 3],
    /// Right-handed rotation about the frame's z, in degrees.
    pub yaw_deg: f64,
    /// Distance between the jaws when they touch the part, in metres.
    pub opening_m: f64,
    /// Radius that contains the position with a probability of 68 %, in millimetres.
    pub sigma_mm: f64,
    /// Half width of the range that contains the rotation with a probability of 68 %, in degrees.
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
