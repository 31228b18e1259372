//! What is wrong with a workcell's file.

/// What is wrong, and in which line.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("line {line}: {what}")]
pub struct WorkcellError {
    /// Counted from 1.
    pub line: usize,
    /// What was expected, and what was found.
    pub what: String,
}
