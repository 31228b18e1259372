//! Progress of a teaching.

use sdg_training::{StepRecord, ValidationRecord};

/// Progress of a teaching.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum TeachingEvent {
    /// A step of model A's orientation CNN, which is taught before the detector.
    OrientationStep {
        /// From zero.
        step: usize,
        /// Number of steps of its run, as known now.
        planned_steps: usize,
        /// Cross-entropy before the update, in nats per crop.
        loss: f64,
        /// Since the start of its run.
        elapsed_secs: f64,
    },
    /// A step of the detector.
    Step {
        /// The step.
        record: StepRecord,
        /// Number of steps of the run, as known now.
        planned_steps: usize,
        /// Since the start of the run.
        elapsed_secs: f64,
    },
    /// A validation of the detector, with the model's reading.
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
