//! Errors that the caller can complete, for example with the name of an option.

use std::path::PathBuf;

use thiserror::Error;

/// Errors that another request would avoid.
#[derive(Debug, Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the messages say what the fields are")]
pub enum EvaluationError {
    /// A folder's record was made with other settings than requested.
    #[error("{}: made with other settings ({difference})", path.display())]
    OtherSettings { path: PathBuf, difference: String },
    /// A unit was done with other settings than requested.
    #[error("{unit}: done with other settings ({difference})")]
    UnitOfOtherSettings { unit: String, difference: String },
    /// Labelled pictures have several labels, none of which is the model's object.
    #[error(
        "{}: expected instances of one label, or some labelled {object} as the model's object is, found {found}",
        folder.display()
    )]
    SeveralLabels { folder: PathBuf, object: String, found: String },
}
