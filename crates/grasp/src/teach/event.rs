//! The progress of teaching.

use sdg_training::{StepRecord, ValidationRecord};

/// The progress of teaching.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum TeachingEvent {
    /// A step of model A's orientation CNN, which is taught before the detector.
    OrientationStep {
        /// Index of the step, from zero.
        step: usize,
        /// Number of steps of the CNN's training, as known now.
        planned_steps: usize,
        /// Cross-entropy before the update, in nats per crop.
        loss: f64,
        /// Time since the start of the CNN's training.
        elapsed_secs: f64,
    },
    /// A step of the detector.
    Step {
        /// The step.
        record: StepRecord,
        /// Number of steps of the training, as known now.
        planned_steps: usize,
        /// Time since the start of the training.
        elapsed_secs: f64,
    },
    /// A validation of the detector, with poses as the model derives them.
    Validated(ValidationRecord),
}

impl From<sdg_training::TrainingEvent> for TeachingEvent {
    fn from(event: sdg_training::TrainingEvent) -> Self {
        match event {
            sdg_training::TrainingEvent::Step { record, planned_steps, elapsed_secs } => {
                Self::Step { record, planned_steps, elapsed_secs }
            }
            sdg_training::TrainingEvent::Validated(record) => Self::Validated(record),
        }
    }
}
