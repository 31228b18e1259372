//! Bytes that are not a message of the protocol.

/// Bytes that are not a message.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the messages say what the fields are")]
pub enum WireError {
    /// A message ended too early.
    #[error("a {message} of at least {expected} bytes was expected, {found} were found")]
    Short {
        message: &'static str,
        /// Number of bytes read so far.
        expected: usize,
        found: usize,
    },
    /// A message continues after its last field.
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
    #[error("{found} is not a valid {field}")]
    Value { field: &'static str, found: u32 },
}
