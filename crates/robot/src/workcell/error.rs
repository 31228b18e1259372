//! Errors of a workcell file.

/// An error and its line.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("line {line}: {what}")]
pub struct WorkcellError {
    /// Counted from 1.
    pub line: usize,
    /// The cause, in most cases with the expected and the found value.
    pub what: String,
}
