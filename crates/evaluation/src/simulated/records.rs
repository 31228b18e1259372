//! Records of units of work, as the store keeps them.

use sdg_grasp::TeachingFacts;
use sdg_report::DetectionError;
use sdg_robot::GraspStep;
use serde::{Deserialize, Serialize};

use crate::rehearsal::{Looks, RehearsedAttempt, step_name};
use crate::trial::{RIGHT_DEGREES, RIGHT_MM, Trial};

/// Steps that one value of a teaching's loss stands for.
pub const LOSS_STEPS: usize = 10;

/// How a teaching ended.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum TeachingRecord {
    /// There is a model.
    Taught {
        /// Its own description.
        facts: Box<TeachingFacts>,
        /// Size of its file.
        bytes: usize,
        /// How many units ran side by side meanwhile.
        jobs: usize,
        /// Mean loss of every [`LOSS_STEPS`] steps; none without a network.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        losses: Vec<f64>,
    },
    Failed {
        /// Why, in one line.
        why: String,
    },
}

/// One grasp attempt.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AttemptRecord {
    /// Its number, from 1.
    pub attempt: usize,
    /// Whether the part was held at the end.
    pub success: bool,
    /// The step at which it ended.
    pub step: String,
    /// Why it failed; empty on success.
    pub why: String,
    /// Place of the last detection beside the truth, in millimetres.
    pub error_mm: Option<f64>,
    /// Turn of the last detection beside the truth, in degrees.
    pub error_deg: Option<f64>,
    /// How often the camera looked.
    pub looks: Looks,
    pub seconds: f64,
}

impl AttemptRecord {
    /// Where an attempt ends that the simulation itself gave up.
    pub const SIMULATION: &str = "simulation";
    /// Where an attempt ends for which there is no model.
    pub const TEACH: &str = "teach";

    /// Everything at which an attempt can end, in order.
    pub fn steps() -> impl Iterator<Item = &'static str> {
        [Self::TEACH].into_iter().chain(GraspStep::ALL.map(GraspStep::name)).chain([Self::SIMULATION])
    }

    /// As the rehearsal gives it.
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

    /// An attempt that failed without the robot's doing.
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

    /// Whether the part was held and both its detections came of a first look: from the look-out pose and from above.
    pub fn is_held_at_first_look(&self) -> bool {
        self.success && self.looks == Looks { from_afar: 1, from_above: 1 }
    }
}

/// The attempts of a cell so far, in their order.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AttemptsRecord {
    /// How attempts are recorded: [`Self::VERSION`]. Those of another version are made again.
    pub version: u32,
    pub attempts: Vec<AttemptRecord>,
}

impl AttemptsRecord {
    /// The version of what an attempt leaves behind: raised when a field of it comes or goes.
    pub const VERSION: u32 = 2;

    /// Those of this version.
    pub fn new(attempts: Vec<AttemptRecord>) -> Self {
        Self { version: Self::VERSION, attempts }
    }
}

/// A model's detections in a picture.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct DetectionRecord {
    /// Score of the best detection, accepted or not; zero for none.
    pub score: f64,
    /// The network's own score of it.
    pub network_score: f64,
    /// How well the demonstration agrees there, where it was asked.
    pub agreement: Option<f64>,
    /// Place of the best detection beside the truth, in millimetres; `None` without a part or a detection.
    pub error_mm: Option<f64>,
    /// Turn of the best detection beside the truth, in degrees.
    pub error_deg: Option<f64>,
}

impl DetectionRecord {
    /// As the trial gives it.
    pub fn new(trial: &Trial) -> Self {
        Self {
            score: trial.best_score,
            network_score: trial.network_score,
            agreement: trial.best_agreement,
            error_mm: trial.best_error.map(|e| e.distance_mm),
            error_deg: trial.best_error.map(|e| e.angle_deg),
        }
    }

    /// Whether the part was detected.
    pub fn is_accepted(&self) -> bool {
        self.score >= 0.5
    }

    /// The error against the truth, where the part was detected.
    pub fn error(&self) -> Option<DetectionError> {
        let (distance_mm, angle_deg) = self.error_mm.zip(self.error_deg)?;
        self.is_accepted().then_some(DetectionError { distance_mm, angle_deg })
    }

    /// Whether that is near enough to the truth.
    pub fn is_right(&self) -> bool {
        self.error().is_some_and(|e| e.distance_mm <= RIGHT_MM && e.angle_deg <= RIGHT_DEGREES)
    }
}

/// A picture and the detections in it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PictureRecord {
    /// Seed of its scene.
    pub seed: u64,
    /// Another shipped part that lies there, where the taught one does not.
    pub other_part: Option<String>,
    /// With the check against the demonstration.
    pub verified: DetectionRecord,
    /// Without it; `None` for a model that is nothing but the demonstration.
    pub alone: Option<DetectionRecord>,
}

/// A model's detections in a part's pictures.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct LookRecord {
    /// The part is there.
    pub present: Vec<PictureRecord>,
    /// It is not, but other things are.
    pub absent: Vec<PictureRecord>,
}

/// How long a detection takes with the machine to itself.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct SpeedRecord {
    /// Cores that it had.
    pub cores: usize,
    /// Seconds an image, with the check against the demonstration.
    pub verified_secs: Vec<f64>,
    /// Seconds an image without it.
    pub alone_secs: Vec<f64>,
}
