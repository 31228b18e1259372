//! The outcome of one teaching, as a line of JSON.

use serde::{Deserialize, Serialize};

/// What becomes of one teaching.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Outcome {
    /// The name of the weights.
    pub weights: String,
    /// Seed of the part.
    pub part: u64,
    /// Steps of teaching.
    pub steps: usize,
    /// Seed of teaching.
    pub seed: u64,
    /// Pictures with the part, and those in which the surest accepted detection is right, and in which it is wrong.
    pub with: usize,
    /// Right.
    pub found: usize,
    /// Accepted at a wrong place.
    pub wrong: usize,
    /// Pictures with other parts alone, and those with an accepted detection.
    pub without: usize,
    /// False alarms.
    pub alarms: usize,
    /// Pictures with look-alikes alone, and those with an accepted detection.
    pub look_alikes: usize,
    /// Look-alikes taken for the part.
    pub look_alike_alarms: usize,
    /// Pictures with the part in which the surest detection, accepted or not, is right.
    pub placed: usize,
    /// Of those placed, the ones whose score is above that of all but one of the pictures with other parts alone: what the
    /// best threshold would accept at one false alarm.
    #[serde(default)]
    pub separated: usize,
    /// Median error of what is right, in pixels of the photo.
    pub error_px: Option<f64>,
    /// Processor time of teaching, seconds.
    pub cpu_secs: f64,
    /// Steps done: an early stop makes them fewer.
    pub steps_done: usize,
    /// Why there is no model; pictures then count as neither found nor alarms.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub failed: Option<String>,
}

/// The outcomes in JSON lines. A line that was cut off when the program was stopped is none: it is measured again.
pub fn outcomes(text: &str) -> Vec<Outcome> {
    text.lines().filter_map(|line| serde_json::from_str(line).ok()).collect()
}
