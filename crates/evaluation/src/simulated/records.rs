//! Stored records of units of work.

use sdg_grasp::TeachingFacts;
use sdg_report::DetectionError;
use sdg_robot::GraspStep;
use serde::{Deserialize, Serialize};

use crate::rehearsal::{Looks, RehearsedAttempt, SIMULATION, step_name};
use crate::trial::{RIGHT_DEGREES, RIGHT_MM, Trial};

/// Number of steps per stored value of the loss.
pub const LOSS_STEPS: usize = 10;

/// The outcome of a teaching run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum TeachingRecord {
    /// Teaching gave a model.
    Taught {
        /// The model's description of its teaching run.
        facts: Box<TeachingFacts>,
        /// Size of the model file.
        bytes: usize,
        /// Number of units that ran in parallel.
        jobs: usize,
        /// Mean loss of every [`LOSS_STEPS`] steps; empty without a network.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        losses: Vec<f64>,
    },
    Failed {
        /// The reason of the failure, on one line.
        why: String,
    },
}

/// A grasp attempt.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AttemptRecord {
    /// Number of the attempt, from 1.
    pub attempt: usize,
    /// Whether the part was held at the end.
    pub success: bool,
    /// The step at which the attempt ended.
    pub step: String,
    /// The reason of the failure; empty on success.
    pub why: String,
    /// Position error of the last detection, in millimetres.
    pub error_mm: Option<f64>,
    /// Angle error of the last detection, in degrees.
    pub error_deg: Option<f64>,
    /// Number of searched pictures.
    pub looks: Looks,
    pub seconds: f64,
}

impl AttemptRecord {
    /// Name of the step for an attempt in which the simulation failed.
    pub const SIMULATION: &str = SIMULATION;
    /// Name of the step for an attempt without a model.
    pub const TEACH: &str = "teach";

    /// All steps at which an attempt can end, in order.
    pub fn steps() -> impl Iterator<Item = &'static str> {
        [Self::TEACH].into_iter().chain(GraspStep::ALL.map(GraspStep::name)).chain([Self::SIMULATION])
    }

    /// The record of a rehearsal's attempt.
    pub fn new(RehearsedAttempt { attempt, looks, .. }: &RehearsedAttempt) -> Self {
        Self {
            attempt: attempt.number,
            success: attempt.success,
            step: step_name(attempt).to_owned(),
            why: attempt.why.clone(),
            error_mm: attempt.detection_error.map(|e| e.distance_mm),
            error_deg: attempt.detection_error.map(|e| e.angle_deg),
            looks: *looks,
            seconds: attempt.duration_secs,
        }
    }

    /// The record of a failed attempt without a report: teaching or the simulation failed.
    pub fn failed(attempt: usize, step: &str, why: String) -> Self {
        Self {
            attempt,
            success: false,
            step: step.to_owned(),
            why,
            error_mm: None,
            error_deg: None,
            looks: Looks::default(),
            seconds: 0.0,
        }
    }

    /// Whether the part was held, and was found in the first picture both from the look-out pose and from above.
    pub fn is_held_at_first_look(&self) -> bool {
        self.success && self.looks == Looks { from_afar: 1, from_above: 1 }
    }
}

/// The stored attempts of a cell, in order.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AttemptsRecord {
    /// Version of the records: [`Self::VERSION`]. Attempts of another version are made again.
    pub version: u32,
    pub attempts: Vec<AttemptRecord>,
}

impl AttemptsRecord {
    /// Current version of the record of an attempt; raised when a field is added or removed.
    pub const VERSION: u32 = 2;

    /// Attempts of the current version.
    pub fn new(attempts: Vec<AttemptRecord>) -> Self {
        Self { version: Self::VERSION, attempts }
    }
}

/// A model's best detection in a picture.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct DetectionRecord {
    /// Score of the best detection, accepted or not; zero if there is none.
    pub score: f64,
    /// The network's score of the best detection.
    pub network_score: f64,
    /// Agreement with the demonstration at the best detection, if it was checked.
    pub agreement: Option<f64>,
    /// Position error of the best detection, in millimetres; `None` without a part or a detection.
    pub error_mm: Option<f64>,
    /// Angle error of the best detection, in degrees.
    pub error_deg: Option<f64>,
}

impl DetectionRecord {
    /// The record of a trial.
    pub fn new(trial: &Trial) -> Self {
        Self {
            score: trial.best_score,
            network_score: trial.network_score,
            agreement: trial.best_agreement,
            error_mm: trial.best_error.map(|e| e.distance_mm),
            error_deg: trial.best_error.map(|e| e.angle_deg),
        }
    }

    /// Whether a detection was accepted.
    pub fn is_accepted(&self) -> bool {
        self.score >= 0.5
    }

    /// The error, if a detection was accepted and the part is in the picture.
    pub fn error(&self) -> Option<DetectionError> {
        let (distance_mm, angle_deg) = self.error_mm.zip(self.error_deg)?;
        self.is_accepted().then_some(DetectionError { distance_mm, angle_deg })
    }

    /// Whether the part was detected, with an error within the limits.
    pub fn is_right(&self) -> bool {
        self.error().is_some_and(|e| e.distance_mm <= RIGHT_MM && e.angle_deg <= RIGHT_DEGREES)
    }
}

/// A picture and the detections in it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PictureRecord {
    /// Seed of the scene.
    pub seed: u64,
    /// Another shipped part, which is in a picture without the taught one.
    pub other_part: Option<String>,
    /// The detection with the check against the demonstration.
    pub verified: DetectionRecord,
    /// The detection without the check; `None` for a model without a network.
    pub alone: Option<DetectionRecord>,
}

/// A model's detections in a part's pictures.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct LookRecord {
    /// Pictures with the part.
    pub present: Vec<PictureRecord>,
    /// Pictures without the part but with other objects.
    pub absent: Vec<PictureRecord>,
}

/// Duration of detections while the machine has no other load.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct SpeedRecord {
    /// Number of cores.
    pub cores: usize,
    /// Seconds per image, with the check against the demonstration.
    pub verified_secs: Vec<f64>,
    /// Seconds per image, without the check.
    pub alone_secs: Vec<f64>,
}
