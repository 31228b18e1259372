//! Records of the pictures of a set, as the store keeps them.

use serde::{Deserialize, Serialize};

/// An accepted detection beside the instance of the part that it lies nearest to.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct MetricAnswer {
    pub score: f64,
    /// Place beside the instance, in millimetres; `None` without an instance.
    pub error_mm: Option<f64>,
    /// Turn beside the instance, in degrees, modulo the part's symmetry.
    pub error_deg: Option<f64>,
    /// The standard deviation of each coordinate that the detection expects, in millimetres.
    pub sigma_mm: f64,
    /// The one of its turn, in degrees.
    pub sigma_deg: f64,
    /// The instance that it found: within 10 mm and 10°, and found by no better detection.
    pub found: Option<usize>,
}

/// A picture and a model's detections in it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CameraPicture {
    /// Which of the set's pictures.
    pub number: u64,
    /// Height of the camera over the table, in metres.
    pub height_m: f64,
    /// Its tilt from straight down, in degrees.
    pub tilt_deg: f64,
    /// How many of the part are in the picture.
    pub instances: usize,
    /// Accepted detections, best first; where there is at most one instance, the best alone.
    pub answers: Vec<MetricAnswer>,
}

/// A model's detections in all pictures of a part and set.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CameraRecord {
    pub pictures: Vec<CameraPicture>,
    pub seconds: f64,
}
