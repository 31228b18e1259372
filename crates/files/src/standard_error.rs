//! Text on standard error.

use std::fmt::Arguments;
use std::io::{Write, stderr};

/// Writes text to standard error as far as possible. `eprintln!` panics if the disk is full or the reader has closed the
/// pipe, but work must not end, nor a moving arm stop, because its log cannot be written.
pub fn print_stderr(text: Arguments<'_>) {
    let _ = stderr().write_fmt(text);
}
