//! Tests a model on unseen pictures of the simulator, compared with the ground truth.

use anyhow::Result;
use image::RgbImage;
use sdg_cell::drawing;
use sdg_grasp::{GraspDetection, GraspModel, Verification};
use sdg_report::DetectionError;
use sdg_simulation::objects::ObjectSpec;
use sdg_simulation::views::{TestView, test_views};

use crate::against_truth::{grasp_error, grasp_pose};

/// Maximum position error of a correct detection, in millimetres.
pub const RIGHT_MM: f64 = 10.0;
/// Maximum angle error of a correct detection, in degrees.
pub const RIGHT_DEGREES: f64 = 10.0;

/// A picture and the model's detections in it.
pub struct Trial {
    /// The picture with all detections drawn on it.
    pub drawn: RgbImage,
    /// Whether the part is in the picture.
    pub present: bool,
    /// Score of the best detection, accepted or not; zero if there is none.
    pub best_score: f64,
    /// Agreement of the best detection with the demonstration, if it was checked.
    pub best_agreement: Option<f64>,
    /// The network's score of the best detection; zero if there is none.
    pub network_score: f64,
    /// Error of the best detection, if it was accepted and the part is in the picture.
    pub error: Option<DetectionError>,
    /// Error of the best detection, even if it was refused.
    pub best_error: Option<DetectionError>,
    /// Duration of the detection, in seconds.
    pub seconds: f64,
}

impl Trial {
    /// Whether the part is in the picture and was found with an error within the limits.
    pub fn is_right(&self) -> bool {
        self.error.is_some_and(|e| e.distance_mm <= RIGHT_MM && e.angle_deg <= RIGHT_DEGREES)
    }

    /// Whether the part is not in the picture but a detection was accepted.
    pub fn is_false_alarm(&self) -> bool {
        !self.present && self.best_score >= 0.5
    }
}

/// Runs a model on `count` pictures, with seeds from `seed`, with or without the part.
pub fn try_views(
    model: &GraspModel,
    object: &ObjectSpec,
    present: bool,
    count: usize,
    seed: u64,
    verification: Verification,
) -> Result<Vec<Trial>> {
    test_views(object, present, count, seed).map(|seen| try_view(model, object, &seen?, verification)).collect()
}

/// Runs a model on one picture. The part is in the picture if there is a ground truth.
pub fn try_view(model: &GraspModel, object: &ObjectSpec, seen: &TestView, verification: Verification) -> Result<Trial> {
    let start = std::time::Instant::now();
    let detections = model.detect(&seen.view.image, verification)?;
    let seconds = start.elapsed().as_secs_f64();
    let best = detections.first();
    let error = |detection: &GraspDetection| -> Option<DetectionError> {
        let truth = seen.truth.as_ref()?;
        let pose = grasp_pose(object, &seen.view.camera, &detection.grasp).ok()?;
        Some(grasp_error(object, &truth.base_from_object, &pose.base_from_tcp))
    };
    let best_error = best.and_then(error);
    Ok(Trial {
        drawn: drawing::with_detections(&seen.view.image, &detections),
        present: seen.truth.is_some(),
        best_score: best.map_or(0.0, |d| d.score),
        best_agreement: best.and_then(|d| d.agreement),
        network_score: best.map_or(0.0, |d| d.network_score),
        error: best_error.filter(|_| best.is_some_and(GraspDetection::is_accepted)),
        best_error,
        seconds,
    })
}
