//! Errors that the caller can complete, for example with the name of an option.

use std::path::PathBuf;

use thiserror::Error;

/// Errors that the caller can avoid with another request.
#[derive(Debug, Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the messages say what the fields are")]
pub enum EvaluationError {
    /// The record in a folder was made with different settings.
    #[error("{}: made with other settings ({difference})", path.display())]
    OtherSettings { path: PathBuf, difference: String },
    /// A unit was done with different settings.
    #[error("{unit}: done with other settings ({difference})")]
    UnitOfOtherSettings { unit: String, difference: String },
    /// Labelled pictures have several labels, and none of them is the model's object.
    #[error(
        "{}: expected instances of one label, or some with the label {object} of the model's object, found {found}",
        folder.display()
    )]
    SeveralLabels { folder: PathBuf, object: String, found: String },
}
