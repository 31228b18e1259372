//! Bytes that are no message of the protocol.

/// Bytes that are no message.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the messages say what the fields are")]
pub enum WireError {
    /// A message ended too early.
    #[error("a {message} of at least {expected} bytes was expected, {found} were found")]
    Short {
        message: &'static str,
        /// What was read up to here.
        expected: usize,
        found: usize,
    },
    /// A message goes on after its last field.
    #[error("a {message} of {expected} bytes was expected, {found} were found")]
    Long {
        message: &'static str,
        /// The size of the message.
        expected: usize,
        found: usize,
    },
    /// A header with an impossible size.
    #[error("a message of {min} to {max} bytes was expected, its header says {found}")]
    MessageSize { min: u32, max: u32, found: u32 },
    /// A number without a meaning.
    #[error("{found} is no {field}")]
    Value { field: &'static str, found: u32 },
}
