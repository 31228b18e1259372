//! Training a detector: from samples to the best of the validated checkpoints.

mod batch;
mod config;
mod progress;
mod trainer;
mod validation;

pub use batch::{SampleSource, first_windows};
pub use config::{EarlyStop, TrainingConfig, ValidationConfig, WindowPhase};
pub use progress::{History, LossValues, StepRecord, TrainingEvent, ValidationRecord};
pub use trainer::{Trained, step_seed, train};
pub use validation::{HIT_DEGREES, HIT_PX, Outcome, Validation};
