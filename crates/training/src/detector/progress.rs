//! Progress of a run, and its record.

use burn::tensor::Tensor;
use sdg_detection::Losses;
use serde::{Deserialize, Serialize};

use super::validation::Validation;
use crate::pace::Ending;
use crate::run::LossFigures;

/// The losses of one step.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct LossValues {
    /// Objectness of anchors.
    pub rpn_cls: f64,
    /// Deltas of anchors.
    pub rpn_loc: f64,
    /// Class of proposals.
    pub cls: f64,
    /// Deltas of proposals.
    pub box_reg: f64,
    /// Positions of keypoints; zero for a detector without keypoints.
    pub keypoint: f64,
    /// Masks; zero for a detector without masks.
    #[serde(default)]
    pub mask: f64,
}

impl LossValues {
    /// The sum of the losses, which is minimised.
    pub fn total(&self) -> f64 {
        self.rpn_cls + self.rpn_loc + self.cls + self.box_reg + self.keypoint + self.mask
    }
}

impl LossFigures for LossValues {
    const NAME: &'static str = "loss";

    fn total(&self) -> f64 {
        self.total()
    }
}

impl From<&Losses> for LossValues {
    /// Reads the losses, waiting for the device.
    fn from(losses: &Losses) -> Self {
        let value = |loss: &Tensor<1>| f64::from(loss.clone().into_scalar::<f32>());
        Self {
            rpn_cls: value(&losses.rpn_cls),
            rpn_loc: value(&losses.rpn_loc),
            cls: value(&losses.cls),
            box_reg: value(&losses.box_reg),
            keypoint: losses.keypoint.as_ref().map_or(0.0, value),
            mask: losses.mask.as_ref().map_or(0.0, value),
        }
    }
}

/// One optimiser step.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct StepRecord {
    /// Index of the step, from zero.
    pub step: usize,
    /// Number of samples in the step.
    pub samples: usize,
    /// Learning rate of this step.
    pub learning_rate: f64,
    /// Losses before the update.
    pub losses: LossValues,
}

/// One validation.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ValidationRecord {
    /// Steps done before the validation.
    pub steps_done: usize,
    /// Seconds since the start of the run.
    pub elapsed_secs: f64,
    /// The validation's measurements.
    pub validation: Validation,
}

/// Progress of a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum TrainingEvent {
    /// A step was done.
    Step {
        /// The step.
        record: StepRecord,
        /// Number of steps of the run, as known now.
        planned_steps: usize,
        /// Seconds since the start of the run.
        elapsed_secs: f64,
    },
    /// A validation was done.
    Validated(ValidationRecord),
}

/// The figures of a whole run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct History {
    /// Every step.
    pub steps: Vec<StepRecord>,
    /// Every validation.
    pub validations: Vec<ValidationRecord>,
    /// The validation of the kept detector.
    pub best: ValidationRecord,
    /// The reason for the end of the run.
    pub ending: Ending,
    /// Wall-clock time of the run, in seconds.
    pub elapsed_secs: f64,
}
