//! Errors that a caller can help with: its own words follow, such as the option to give.

use std::path::PathBuf;

use thiserror::Error;

/// What another request would avoid.
#[derive(Debug, Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the messages say what the fields are")]
pub enum EvaluationError {
    /// A folder's record was made with other settings than those that are asked for.
    #[error("{}: made with other settings ({difference})", path.display())]
    OtherSettings { path: PathBuf, difference: String },
    /// A unit was done with other settings than those that are asked for.
    #[error("{unit}: done with other settings ({difference})")]
    UnitOfOtherSettings { unit: String, difference: String },
    /// Labelled pictures with several labels, none of which is the model's object.
    #[error(
        "{}: expected instances of one label, or some labelled {object} as the model's object is, found {found}",
        folder.display()
    )]
    SeveralLabels { folder: PathBuf, object: String, found: String },
}
