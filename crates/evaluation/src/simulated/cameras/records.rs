//! Stored records of the pictures of a set.

use serde::{Deserialize, Serialize};

/// An accepted detection, compared with the instance that it found, or else with the nearest one.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct MetricAnswer {
    pub score: f64,
    /// Position error, in millimetres; `None` without an instance.
    pub error_mm: Option<f64>,
    /// Angle error, in degrees, modulo the part's symmetry.
    pub error_deg: Option<f64>,
    /// Radius that contains the position with a probability of 68 % according to the detection, in millimetres.
    pub sigma_mm: f64,
    /// Bound of the angle error that holds with a probability of 68 % according to the detection, in degrees.
    pub sigma_deg: f64,
    /// The instance that the detection found: within 10 mm and 10°, and not found by a better detection.
    pub found: Option<usize>,
}

/// A picture and a model's detections in it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CameraPicture {
    /// Index among the pictures of the set.
    pub number: u64,
    /// Height of the camera above the table, in metres.
    pub height_m: f64,
    /// Tilt of the camera from the vertical, in degrees.
    pub tilt_deg: f64,
    /// Number of instances in the picture.
    pub instances: usize,
    /// Accepted detections, best first; only the best one if there is at most one instance.
    pub answers: Vec<MetricAnswer>,
}

/// A model's detections in all pictures of a part and set.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CameraRecord {
    pub pictures: Vec<CameraPicture>,
    pub seconds: f64,
}
