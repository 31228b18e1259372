//! One reader under attack.

/// Longer than this an execution may never take.
pub const MAX_SECONDS: f64 = 10.0;
/// JSON's values take more than their text.
pub const MAX_BYTES_PER_INPUT_BYTE: usize = 20;

/// One reader under attack.
pub struct Target {
    /// As the command line and files have it.
    pub name: &'static str,
    /// Bytes that may be in use while it reads, beyond [`MAX_BYTES_PER_INPUT_BYTE`] times the input's.
    pub max_extra_bytes: usize,
    /// Executions of the short run that is part of the tests; about a second.
    pub quick_executions: u64,
    /// Words and numbers of the format, which chance would hardly write.
    pub dictionary: &'static [&'static [u8]],
    /// Input that is read without an error, from which all other input is made.
    pub seeds: fn() -> Vec<Vec<u8>>,
    /// Reads the bytes as the program does, and uses what comes out; whether they were accepted.
    pub run: fn(&[u8]) -> bool,
}
