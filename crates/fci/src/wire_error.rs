//! Error for bytes that are not a message of the protocol.

/// Error for bytes that are not a message.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the messages explain the fields")]
pub enum WireError {
    /// A message ended too early.
    #[error("expected a {message} of at least {expected} bytes, found {found}")]
    Short {
        message: &'static str,
        /// Number of bytes needed up to the field that is being read.
        expected: usize,
        found: usize,
    },
    /// A message continues after its last field.
    #[error("expected a {message} of {expected} bytes, found {found}")]
    Long {
        message: &'static str,
        /// The size of the message.
        expected: usize,
        found: usize,
    },
    /// A header with an impossible size.
    #[error("expected a message of {min} to {max} bytes, found a header that announces {found}")]
    MessageSize { min: u32, max: u32, found: u32 },
    /// A number that is not defined for its field.
    #[error("{found} is not a valid {field}")]
    Value { field: &'static str, found: u32 },
}
