//! Records of the pictures of a set, as stored.

use serde::{Deserialize, Serialize};

/// An accepted detection compared with the nearest instance of the part.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct MetricAnswer {
    pub score: f64,
    /// Position error, in millimetres; `None` without an instance.
    pub error_mm: Option<f64>,
    /// Angle error, in degrees, modulo the part's symmetry.
    pub error_deg: Option<f64>,
    /// The detection's standard deviation of each coordinate, in millimetres.
    pub sigma_mm: f64,
    /// The detection's standard deviation of the angle, in degrees.
    pub sigma_deg: f64,
    /// The instance that it found: within 10 mm and 10°, and not found by a better detection.
    pub found: Option<usize>,
}

/// A picture and a model's detections in it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CameraPicture {
    /// Index among the set's pictures.
    pub number: u64,
    /// Height of the camera over the table, in metres.
    pub height_m: f64,
    /// Its tilt from vertical, in degrees.
    pub tilt_deg: f64,
    /// Number of instances in the picture.
    pub instances: usize,
    /// Accepted detections, best first; if there is at most one instance, only the best.
    pub answers: Vec<MetricAnswer>,
}

/// A model's detections in all pictures of a part and set.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CameraRecord {
    pub pictures: Vec<CameraPicture>,
    pub seconds: f64,
}
