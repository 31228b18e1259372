//! The reason why a training run ended without a network.

/// The reason why a run ended without a network.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the messages explain the fields")]
pub enum TrainingError {
    /// An invalid setting of a run.
    #[error("{setting}: expected {expected}, found {found}")]
    BadSetting { setting: &'static str, expected: &'static str, found: String },
    /// A loss that is NaN or infinite.
    #[error("the {name} became {loss} at step {step}; a lower learning rate than {learning_rate:e} may help")]
    Diverged {
        /// Name of the loss, such as "orientation loss".
        name: &'static str,
        step: usize,
        loss: f64,
        /// The learning rate of that step.
        learning_rate: f64,
    },
    /// The observer requested a stop before there was a network to keep.
    #[error("stopped at step {step}, before the first validation: there is no model to keep")]
    StoppedTooEarly { step: usize },
    /// The held-out samples could not be examined.
    #[error("the held-back samples cannot be examined: {0}")]
    Examination(Box<dyn std::error::Error + Send + Sync>),
    /// A demonstration that cannot be taught.
    #[error(transparent)]
    Demonstration(#[from] sdg_demonstration::Error),
    /// Initial parameters of the orientation CNN that belong to another network.
    #[error("initial weights of the orientation CNN: expected those of this network, found a difference in {name}")]
    Start {
        /// The first parameter that does not fit.
        name: String,
    },
    /// An invalid setting of the orientation CNN or of its training, or a crop that it rejected.
    #[error(transparent)]
    Orientation(#[from] sdg_orientation::OrientationError),
    /// The network rejected a batch.
    #[error(transparent)]
    Detection(#[from] sdg_detection::DetectionError),
}
