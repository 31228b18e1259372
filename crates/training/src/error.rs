//! Why a training run ended without a detector.

/// What went wrong.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the messages say what the fields are")]
pub enum TrainingError {
    /// A setting that no run can have.
    #[error("{setting}: expected {expected}, found {found}")]
    BadSetting { setting: &'static str, expected: &'static str, found: String },
    /// A loss that is NaN or infinite.
    #[error("the loss became {loss} at step {step}; a lower learning rate than {learning_rate:e} may help")]
    Diverged {
        step: usize,
        loss: f64,
        /// The learning rate of that step.
        learning_rate: f64,
    },
    /// The observer asked to stop before there was anything to keep.
    #[error("stopped at step {step}, before the first validation: there is no model to keep")]
    StoppedTooEarly { step: usize },
    /// The held-back samples could not be looked at.
    #[error("the held-back samples cannot be examined: {0}")]
    Examination(Box<dyn std::error::Error + Send + Sync>),
    /// The network refused a batch.
    #[error(transparent)]
    Detection(#[from] sdg_detection::DetectionError),
}
