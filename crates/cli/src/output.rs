//! Standard output and standard error. The macros replace those of std in this crate, which panic if the disk is full or
//! the reader has closed the pipe: a motion, a model or a report must not be lost because a text cannot be written.

use std::fmt::Arguments;
use std::io::{self, Write, stdout};
use std::sync::{Mutex, PoisonError};

use anyhow::{Context, Result};

/// The first error of standard output.
static ERROR: Mutex<Option<io::Error>> = Mutex::new(None);

macro_rules! print {
    ($($text:tt)*) => { $crate::output::print_stdout(format_args!($($text)*)) };
}

macro_rules! println {
    ($($text:tt)*) => { $crate::output::print_stdout(format_args!("{}\n", format_args!($($text)*))) };
}

macro_rules! eprint {
    ($($text:tt)*) => { sdg_files::print_stderr(format_args!($($text)*)) };
}

macro_rules! eprintln {
    ($($text:tt)*) => { sdg_files::print_stderr(format_args!("{}\n", format_args!($($text)*))) };
}

/// Writes text to standard output; [`finish`] returns the first error.
pub fn print_stdout(text: Arguments<'_>) {
    if let Err(error) = stdout().write_fmt(text) {
        ERROR.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
    }
}

/// The first error since the last call.
fn take_error() -> Option<io::Error> {
    ERROR.lock().unwrap_or_else(PoisonError::into_inner).take()
}

/// For work whose only results are printed: it need not go on after an error of standard output.
///
/// # Errors
/// A text could not be written.
pub fn check() -> Result<()> {
    take_error().map_or(Ok(()), Err).context("standard output")
}

/// Writes the rest of standard output at the end of a command.
///
/// # Errors
/// A text could not be written, and not because the reader closed the pipe, as `head` does.
pub fn finish() -> Result<()> {
    let flushed = stdout().flush();
    match take_error().map_or(flushed, Err) {
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(()),
        written => written.context("standard output"),
    }
}
