//! `--demo IMAGE:ANNOTATION`, or `--demo IMAGE` with the marks beside it: a photo and the marks on it.

use std::path::PathBuf;

use anyhow::Result;
use sdg_demonstration::Demonstration;
use sdg_inputs::{NotAPair, demonstrations};

use crate::exit::Usage;

/// Reads a demonstration from each argument.
pub fn read_all(arguments: &[String]) -> Result<Vec<Demonstration>> {
    pairs(arguments)?.iter().map(|(photo, marks)| demonstrations::read_pair(photo, marks)).collect()
}

/// The photo and the annotation file of each argument.
///
/// # Errors
/// A photo does not exist or has no marks beside it; [`Usage`] for a malformed argument.
pub fn pairs(arguments: &[String]) -> Result<Vec<(PathBuf, PathBuf)>> {
    arguments.iter().map(|argument| photo_and_marks(argument)).collect()
}

/// The photo and the annotation file of an argument; for a photo alone, the annotation beside it.
pub fn photo_and_marks(argument: &str) -> Result<(PathBuf, PathBuf)> {
    demonstrations::photo_and_marks(argument).map_err(|error| match error.downcast_ref() {
        Some(NotAPair { .. }) => Usage(format!("--demo: {error}")).into(),
        None => error,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_an_argument_is_wrong_usage() {
        for argument in ["", "a.png:", ":b.json"] {
            assert!(photo_and_marks(argument).unwrap_err().is::<Usage>(), "{argument}");
        }
    }
}
