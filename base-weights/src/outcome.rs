//! The outcome of one teaching run, as a line of JSON.

use serde::{Deserialize, Serialize};

/// The outcome of one teaching run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Outcome {
    /// The name of the weights.
    pub weights: String,
    /// Seed of the part.
    pub part: u64,
    /// Number of teaching steps.
    pub steps: usize,
    /// Seed of teaching.
    pub seed: u64,
    /// Number of pictures with the part.
    pub with: usize,
    /// Pictures with the part in which the accepted detection with the highest score is correct.
    pub found: usize,
    /// Pictures with the part in which the accepted detection with the highest score is wrong.
    pub wrong: usize,
    /// Number of pictures with other parts only.
    pub without: usize,
    /// False alarms: pictures with other parts only that have an accepted detection.
    pub alarms: usize,
    /// Number of pictures with look-alikes only.
    pub look_alikes: usize,
    /// Pictures with look-alikes only that have an accepted detection.
    pub look_alike_alarms: usize,
    /// Pictures with the part in which the detection with the highest score, accepted or not, is correct.
    pub placed: usize,
    /// The `placed` pictures whose score is above the second-highest score of the pictures with other parts only: the
    /// best threshold would accept them at one false alarm.
    #[serde(default)]
    pub separated: usize,
    /// Median error of the correct accepted detections, in pixels of the photo.
    pub error_px: Option<f64>,
    /// Processor time of teaching, in seconds.
    pub cpu_secs: f64,
    /// Number of steps done, fewer than `steps` after an early stop.
    pub steps_done: usize,
    /// The reason if there is no model; `found` and all alarms are then zero.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub failed: Option<String>,
}

/// The outcomes in JSON lines. An incomplete line, cut off when the program was stopped, is skipped, so its trial is
/// measured again.
pub fn outcomes(text: &str) -> Vec<Outcome> {
    text.lines().filter_map(|line| serde_json::from_str(line).ok()).collect()
}
