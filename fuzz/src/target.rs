//! A reader that is tested with hostile input.

/// Maximum time of an execution.
pub const MAX_SECONDS: f64 = 10.0;
/// Maximum memory per byte of input; parsed JSON values take more than their text.
pub const MAX_BYTES_PER_INPUT_BYTE: usize = 20;

/// A reader that is tested with hostile input.
pub struct Target {
    /// Name on the command line and in file names.
    pub name: &'static str,
    /// Bytes of memory that the reader may use, beyond [`MAX_BYTES_PER_INPUT_BYTE`] times the size of the input.
    pub max_extra_bytes: usize,
    /// Number of executions in the short run that is part of the tests; they take about a second.
    pub quick_executions: u64,
    /// Words and numbers of the format that random mistakes would hardly produce.
    pub dictionary: &'static [&'static [u8]],
    /// Valid inputs, from which all other inputs are made.
    pub seeds: fn() -> Vec<Vec<u8>>,
    /// Reads the bytes as the program does and uses the result; returns whether the bytes were
    /// accepted.
    pub run: fn(&[u8]) -> bool,
}
